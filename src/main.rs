use std::process::ExitCode;

fn main() -> ExitCode {
    rayo::cli::main()
}
