//! The `voxlathe` command.

fn main() -> std::process::ExitCode {
    voxlathe::cli::run()
}
