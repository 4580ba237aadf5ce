//! The commands, one a file.

/// `println!` that does not mind a reader who has gone (`cutis check scene.toml | head`).
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

mod bake;
mod bake_file;
mod bake_report;
mod bench;
mod check;
mod demo;
mod fineness;
mod fmu;
mod output;
mod portrait;
mod presets;
mod progress;
mod run;
mod study;
mod torture;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// What a command ends with; the message is for a person.
type Done = Result<(), Box<dyn std::error::Error>>;

/// That no name holds the text that a command was given.
fn nothing_named<'a>(what: &str, wanted: &str, choices: impl Iterator<Item = &'a str>) -> Box<dyn std::error::Error> {
    let choices: Vec<String> = choices.map(|c| format!("`{c}`")).collect();
    format!("no {what} has `{wanted}` in its name, expected a part of {}", choices.join(", ")).into()
}

/// Soft tissue of the human face: from a head CT to skin that moves in a co-simulation.
#[derive(Parser)]
#[command(name = "cutis", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make the synthetic head, pack it as FMU, open its jaw, push on its cheek, draw a picture
    Demo(demo::Demo),
    /// From a head CT to a tissue mesh
    Bake(Box<bake::Bake>),
    /// Run a scene's programme; writes a table, a ParaView series and a picture
    Run(run::Run),
    /// Pack a scene as FMI 3.0 and FMI 2.0 co-simulation components
    Fmu(fmu::Fmu),
    /// Say what a scene holds: mesh, bones, variables, warnings
    Check(check::Check),
    /// Print the tissues that a scene can name, with their sources
    Presets(presets::Presets),
    /// Run a scene over a ladder of methods: what accuracy costs in time, and what a budget buys
    Study(study::Study),
    /// Run the catalogue of hard cases and say how each ends
    Torture(torture::Torture),
    /// Measure a step and its parts against what this machine allows
    Bench(bench::Bench),
}

/// Runs the command that the arguments name.
pub fn run() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Demo(demo) => demo.run(),
        Command::Bake(bake) => bake.run(),
        Command::Run(run) => run.run(),
        Command::Fmu(fmu) => fmu.run(),
        Command::Check(check) => check.run(),
        Command::Presets(presets) => presets.run(),
        Command::Torture(torture) => torture.run(),
        Command::Study(study) => study.run(),
        Command::Bench(bench) => bench.run(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}
