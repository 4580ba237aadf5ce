//! What others build on: the installed tree, the binary interface.
//!
//! Tools that a machine lacks are named, and their test is left out; `.ci/run` installs them all.

mod delivery {
    mod install;
    mod util;
}
