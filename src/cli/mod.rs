//! The command line: one file per command.
//!
//! | exit code | |
//! |---|---|
//! | 0 | done |
//! | 1 | interrupted, failed through no fault of the input, or beyond a limit that was given |
//! | 2 | bad input: flags, scene, asset, or a place that cannot be written |
//!
//! Standard output carries what was asked for (schema, table, what a model holds, help); all messages go to standard error.

mod bug;
mod compare;
mod export;
mod flags;
mod info;
mod interrupt;
mod job;
mod progress;
mod render;
mod schema;
mod terminal;
mod validate;

use std::{
    io::{self, ErrorKind, Write},
    process::ExitCode,
};

use clap::{Parser, Subcommand};

use terminal::say;

/// Renders scene files, glTF and OBJ with physically based light.
#[derive(Debug, Parser)]
#[command(name = "rayo", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Args),
    Compare(compare::Args),
    Export(export::Args),
    Validate(validate::Args),
    Info(info::Args),
    Schema(schema::Args),
}

/// Why a command did not do what it was asked to.
#[derive(Debug)]
enum Failure {
    /// The user's to mend: exit code 2. Lines ready to print.
    BadInput(String),
    /// Not the input's fault: exit code 1.
    Failed(String),
    /// By the user, who has been told: exit code 1.
    Interrupted,
}

/// On standard output, as it is.
fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().write_all(text.as_bytes()) {
        // Whoever reads has seen enough.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Failure::Failed(format!("error: cannot write to standard output: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Runs the command line of this process.
pub fn main() -> ExitCode {
    bug::keep_reports();
    bug::caught(|| {
        let cli = match Cli::try_parse() {
            Ok(cli) => cli,
            Err(error) => {
                // Help, version or a usage error. That nobody listens (a closed pipe) is no reason to fail.
                let _ = error.print();
                return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
            }
        };
        let result = match cli.command {
            Command::Render(args) => render::run(&args),
            Command::Export(args) => export::run(&args),
            Command::Validate(args) => validate::run(&args),
            Command::Compare(args) => compare::run(&args),
            Command::Info(args) => info::run(&args),
            Command::Schema(args) => schema::run(&args),
        };
        match result {
            Ok(()) => ExitCode::SUCCESS,
            Err(Failure::BadInput(message)) => {
                say(message.trim_end());
                ExitCode::from(2)
            }
            Err(Failure::Failed(message)) => {
                say(message.trim_end());
                ExitCode::FAILURE
            }
            Err(Failure::Interrupted) => ExitCode::FAILURE,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn flags_are_consistent() {
        Cli::command().debug_assert();
    }
}
