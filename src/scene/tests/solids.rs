//! Solids and grids that are refused.

use super::*;
use crate::grid::Channel;

#[test]
fn solids_are_checked() {
    let with = |rest: &str| format!("{SMALL}{rest}\n");
    for bad in ["0", "361", "-361", "nan"] {
        refuses(
            &with(&format!("angle = {bad}")),
            &format!(
                "vase.toml:9:9: solid[0].angle: found {bad}, wanted an angle other than 0, of at most 360 either way"
            ),
        );
    }
    refuses(
        &with("axis = { direction = [0, 0, 0] }"),
        "vase.toml:9:22: solid[0].axis.direction: found [0, 0, 0], wanted a direction: a vector [x, y, z] \
         that is not zero",
    );
    refuses(
        &with("axis = { direction = [1, 2, 3], x = [-2, -4, -6] }"),
        "vase.toml:9:37: solid[0].axis.x: found [-2, -4, -6], wanted a zero-angle direction not parallel \
         to the axis, [1.0, 2.0, 3.0]",
    );
    refuses(
        &small("profile = \"ring\"", "profile = \"rnig\""),
        "vase.toml:8:11: solid[0].profile: found \"rnig\", wanted the name of a profile; did you mean `ring`?",
    );
    refuses(
        &small("profile = \"ring\"", "profile = \"vessel\""),
        "vase.toml:8:11: solid[0].profile: found \"vessel\", wanted the name of a profile; the scene has ring",
    );
    refuses(
        "schema = 1\n[[solid]]\nkind = \"revolve\"\nprofile = \"ring\"\n",
        "vase.toml:4:11: solid[0].profile: found \"ring\", wanted the name of a profile; the scene has no \
         profiles",
    );
    for bad in ["subtract", "intersect"] {
        refuses(
            &with(&format!("operation = \"{bad}\"")),
            &format!(
                "vase.toml:9:13: solid[0].operation: found \"{bad}\", wanted add: there is nothing before \
                 the first solid"
            ),
        );
    }
    refuses(
        &with("material = 0"),
        "vase.toml:9:12: solid[0].material: found 0, wanted an integer from 1 to 4294967295",
    );
    refuses(
        &with("place = [{ scale = 0 }]"),
        "vase.toml:9:20: solid[0].place[0].scale: found 0, wanted a factor greater than 0 (1e-100 to 1e100)",
    );
    refuses(
        &with("place = [{ scale = 2, translate = [1, 2, 3] }]"),
        "vase.toml:9:10: solid[0].place[0]: found several keys in one step, wanted a table for each step, \
         since their order matters",
    );
    refuses(
        &with("name = \"a\"\n[[solid]]\nkind = \"revolve\"\nprofile = \"ring\"\nname = \"a\""),
        "vase.toml:13:8: solid[1].name: found \"a\", wanted a name that no other solid has; solid[0], line \
         6, has it too",
    );
    refuses(
        &with("name = \"revolve 2\"\n[[solid]]\nkind = \"revolve\"\nprofile = \"ring\""),
        "vase.toml:9:8: solid[0].name: found \"revolve 2\", wanted a name that no other solid has; \
         solid[1], line 10, has it too",
    );
}

#[test]
fn grids_are_checked() {
    let with = |rest: &str| format!("{SMALL}[grid]\n{rest}\n");
    refuses(
        &with("resolution = 64\nspacing = 0.5"),
        "vase.toml:11:11: grid.spacing: found `spacing` together with `resolution`, wanted either \
         resolution or spacing",
    );
    refuses(
        &with("dims = [4, 4, 4]"),
        "vase.toml:10:8: grid.dims: found `dims` together with no `origin`, wanted origin, spacing and \
         dims together",
    );
    refuses(
        &with("origin = [0, 0, 0]\nspacing = 1"),
        "vase.toml:10:10: grid.origin: found `origin` together with no `dims`, wanted origin, spacing and \
         dims together",
    );
    refuses(
        &with("bounds = [[0, 0, 0], [1, 0, 1]]"),
        "vase.toml:10:10: grid.bounds: found [[0, 0, 0], [1, 0, 1]], wanted the minimum corner first, less \
         than the maximum corner in x, y and z",
    );
    refuses(
        &with("resolution = 0"),
        "vase.toml:10:14: grid.resolution: found 0, wanted an integer from 1 to 2147483647",
    );
    refuses(
        &with("resolution = [4, 4]"),
        "vase.toml:10:14: grid.resolution: found [4, 4], wanted an integer or [nx, ny, nz]",
    );
    refuses(
        &format!("{SMALL}[output]\nchannels = [\"sfd\"]\n"),
        &format!(
            "vase.toml:10:13: output.channels[0]: found \"sfd\", wanted one of {}, fraction-1; did you mean `sdf`?",
            Channel::ALL
                .iter()
                .map(|c| c.name())
                .collect::<Vec<_>>()
                .join(", ")
        ),
    );
    refuses(
        &format!("{SMALL}[materials]\n0 = \"air\"\n"),
        "vase.toml:10:1: materials.0: found 0, wanted a material id as key: an integer from 1 to 4294967295",
    );
}
