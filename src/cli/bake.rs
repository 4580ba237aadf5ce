//! `cutis bake`.

#[derive(clap::Args)]
pub struct Bake {}

impl Bake {
    pub fn run(self) -> super::Done {
        Ok(())
    }
}
