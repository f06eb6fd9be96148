//! `voxlathe generate`: what shells, editors and manuals need.

use super::arguments::{Arguments, Generate, Kind};
use super::failure::Failure;
use super::output;
use clap::CommandFactory;
use clap_complete::Shell;
use std::process::ExitCode;

pub(super) fn run(arguments: &Generate) -> Result<ExitCode, Failure> {
    let mut bytes = Vec::new();
    let mut command = Arguments::command();
    let mut complete = |shell: Shell| {
        clap_complete::generate(shell, &mut Arguments::command(), "voxlathe", &mut bytes)
    };
    match arguments.kind {
        Kind::Bash => complete(Shell::Bash),
        Kind::Zsh => complete(Shell::Zsh),
        Kind::Fish => complete(Shell::Fish),
        Kind::Powershell => complete(Shell::PowerShell),
        Kind::Schema => bytes.extend(format!("{:#}\n", crate::scene::json_schema()).bytes()),
        Kind::Man => {
            command.build();
            render_man(&command, &mut bytes).map_err(|e| Failure::output(&e))?;
        }
    }
    output::print(&String::from_utf8_lossy(&bytes))?;
    Ok(ExitCode::SUCCESS)
}

/// The page of the command, and those of its commands after it.
fn render_man(command: &clap::Command, out: &mut Vec<u8>) -> std::io::Result<()> {
    clap_mangen::Man::new(command.clone()).render(out)?;
    for sub in command.get_subcommands().filter(|s| s.get_name() != "help") {
        clap_mangen::Man::new(
            sub.clone()
                .display_name(format!("voxlathe {}", sub.get_name())),
        )
        .render(out)?;
    }
    Ok(())
}
