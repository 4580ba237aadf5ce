//! The command line: arguments and printing only; the work is the library's.
#![forbid(unsafe_code)]
#![allow(non_snake_case)]

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
