//! `cutis presets`: tissues by name, with their numbers and sources.

use super::Done;
use cutis::scene::preset_reference;

/// Print the presets.
#[derive(clap::Args)]
pub struct Presets {}

impl Presets {
    pub fn run(&self) -> Done {
        say!("{}", preset_reference());
        Ok(())
    }
}
