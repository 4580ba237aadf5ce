//! The checked-in model descriptions are those of the default scene.

use cutis::fmu::{FmiVersion, description};

use super::util::compare;

#[test]
fn model_descriptions_are_up_to_date() {
    let scene = cutis::load::embedded().unwrap();
    compare("modelDescription.xml", &description(&scene, FmiVersion::V3));
    compare("fmu/fmi2.xml", &description(&scene, FmiVersion::V2));
}

#[test]
fn the_default_scene_has_one_token() {
    let scene = super::util::root().join("fmu/scene.toml");
    let (here, there) = (cutis::load::embedded().unwrap(), cutis::load::from_file(&scene).unwrap());
    assert_eq!(here.model.token(), there.model.token());
}
