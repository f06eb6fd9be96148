//! The `voxlathe` command.

fn main() {}
