//! A scene's text as tables: what identifies its model, and the same scene with its mesh packed beside it.
//!
//! Both work on what the text says, not on how it is written: inline, dotted and multi-line spellings are one.

use std::fmt::Write as _;

use toml::{Table, Value};

use super::SceneError;
use super::file::slip;

/// What tells where the tissue and its skin come from: both stand for themselves in a model.
const SHAPE: [&str; 2] = ["mesh", "skin"];
/// What changes neither the model nor its interface.
const ASIDE: [&str; 3] = ["name", "run", "keyframe"];
/// Keys of `[mesh]` that say what is made of a mesh once it was read.
const OF_ELEMENTS: [&str; 2] = ["order", "curved"];

/// The tables of a scene. Numbers beyond what TOML can hold are refused here, though a key may take them.
fn tables(text: &str) -> Result<Table, SceneError> {
    text.parse().map_err(|e: toml::de::Error| slip(text, &e))
}

/// What identifies a model beside its mesh: everything that the scene says of it, in one spelling.
///
/// # Errors
/// [`SceneError::Meaning`].
pub(super) fn identity(text: &str) -> Result<String, SceneError> {
    let mut scene = tables(text)?;
    SHAPE.iter().chain(&ASIDE).for_each(|key| drop(scene.remove(*key)));
    let mut out = String::new();
    spell(&Value::Table(scene), &mut out);
    Ok(out)
}

/// One spelling for each value: keys in order, all numbers alike.
fn spell(value: &Value, out: &mut String) {
    let done = match value {
        Value::Table(table) => {
            let mut keys: Vec<&String> = table.keys().collect();
            keys.sort_unstable();
            out.push('{');
            for key in keys {
                let _ = write!(out, "{key:?}=");
                spell(&table[key], out);
                out.push(',');
            }
            out.push('}');
            Ok(())
        }
        Value::Array(items) => {
            out.push('[');
            for item in items {
                spell(item, out);
                out.push(',');
            }
            out.push(']');
            Ok(())
        }
        Value::Integer(n) => write!(out, "{:?}", *n as f64),
        Value::Float(x) => write!(out, "{x:?}"),
        Value::Boolean(b) => write!(out, "{b}"),
        Value::String(s) => write!(out, "{s:?}"),
        Value::Datetime(d) => write!(out, "{d}"),
    };
    done.expect("writing to memory does not fail");
}

/// The same scene with its tissue read from `file`, which carries its skin, too.
///
/// # Errors
/// [`SceneError::Meaning`].
pub fn packed(text: &str, file: &str) -> Result<String, SceneError> {
    let mut scene = tables(text)?;
    let given = scene.remove("mesh").and_then(|mesh| mesh.as_table().cloned()).unwrap_or_default();
    let mut mesh = Table::from_iter([("file".to_owned(), Value::String(file.to_owned()))]);
    mesh.extend(given.into_iter().filter(|(key, _)| OF_ELEMENTS.contains(&key.as_str())));
    scene.remove("skin");
    scene.insert("mesh".to_owned(), Value::Table(mesh));
    Ok(toml::to_string(&scene).expect("tables that were read can be written"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spelling_does_not_matter_and_meaning_does() {
        let base = "[mesh]\nfile = \"a.vtu\"\n[[tissue]]\nE = 15e3\nnu = 0.45\n[[bone]]\nname = \"skull\"\n";
        let same = [
            format!("# a comment\n{base}[run]\nend = 3\n"),
            base.replace("[mesh]\nfile = \"a.vtu\"", "mesh = { file = \"b.vtu\" }").replace("15e3", "15000"),
            base.replace("[mesh]\nfile = \"a.vtu\"", "name = \"x\"\nmesh.file = \"a.vtu\"")
                .replace("nu = 0.45\n", "nu=0.450 # soft\n"),
            "mesh.file = \"a.vtu\"\ntissue = [{ nu = 0.45, E = 15e3 }]\nbone = [\n{ name = 'skull' },\n]\n".to_owned(),
        ];
        for text in &same {
            assert_eq!(identity(text).expect(text), identity(base).expect(base), "{text}");
        }
        for other in [base.replace("15e3", "15001"), base.replace("skull", "jaw"), format!("{base}[gravity]\n")] {
            assert_ne!(identity(&other).expect("tables"), identity(base).expect(base), "{other}");
        }
    }

    #[test]
    fn numbers_that_are_none_are_refused() {
        let scene = "[[tissue]]\nE = 9223372036854975807\n";
        assert!(identity(scene).is_err() && packed(scene, "model.cutis").is_err());
    }

    #[test]
    fn every_spelling_is_packed() {
        for mesh in [
            "mesh = { file = \"blk.vtu\", order = 2 }\n",
            "mesh.file = \"blk.vtu\"\nmesh.order = 2\n",
            "mesh.order = 2\n[mesh.block]\nsize = [1, 1, 1]\ncells = [1, 1, 1]\nlayers = [\n  [\"skin\", 0.2],\n  [\"fat\", 0.3],\n]\n",
            "[ mesh ]\nfile = \"blk.vtu\"\norder = 2\n[skin]\nsubdivisions = 1\n",
            "[\"mesh\"]\nfile = '''\n[mesh]\nblk.vtu'''\norder = 2\n",
        ] {
            let scene = format!("{mesh}[[tissue]]\nE = 15e3\n[[bone]]\nname = \"mesh [skin]\"\n");
            let found = tables(&packed(&scene, "model.cutis").expect("tables")).expect("tables");
            let mesh = found["mesh"].as_table().expect("a table");
            assert_eq!(mesh.len(), 2, "{found}");
            assert_eq!((mesh["file"].as_str(), mesh["order"].as_integer()), (Some("model.cutis"), Some(2)), "{found}");
            assert!(!found.contains_key("skin") && found["bone"].as_array().is_some_and(|b| b.len() == 1), "{found}");
        }
    }
}
