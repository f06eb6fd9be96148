//! Curves and profiles that are refused.

use super::*;

fn nurbs(degree: &str, points: &str, rest: &str) -> String {
    curves(&format!(
        "kind = \"nurbs\"\ndegree = {degree}\npoints = {points}\n{rest}\n"
    ))
}

const FOUR: &str = "[[1, 0], [2, 0], [2, 1], [1, 0]]";

#[test]
fn degrees_are_checked() {
    for bad in ["0", "-1", "33", "1000000000", "2.0"] {
        refuses(
            &nurbs(bad, FOUR, ""),
            &format!(
                "vase.toml:4:10: profiles.ring.curves[0].degree: found {bad}, wanted an integer from 1 to 32"
            ),
        );
    }
    refuses(
        &nurbs("4", FOUR, ""),
        "vase.toml:4:10: profiles.ring.curves[0].degree: found 4, wanted a degree below 4, the number of \
         points",
    );
    assert!(toml(&nurbs("3", FOUR, "")).is_ok());
}

#[test]
fn points_are_checked() {
    let wanted = "an array of at least 2 points [r, z], or { file = \"points.csv\" }";
    refuses(
        &nurbs("1", "3", ""),
        &format!(
            "vase.toml:5:10: profiles.ring.curves[0].points: found a number 3, wanted {wanted}"
        ),
    );
    refuses(
        &nurbs("1", "[]", ""),
        "vase.toml:5:10: profiles.ring.curves[0].points: found [], wanted at least 2 points [r, z]",
    );
    refuses(
        &nurbs("1", "[1, 2, 3]", ""),
        "vase.toml:5:11: profiles.ring.curves[0].points[0]: found a number 1, wanted a point [r, z]",
    );
    refuses(
        &nurbs("1", "[[1, 2], [3]]", ""),
        "vase.toml:5:19: profiles.ring.curves[0].points[1]: found [3], wanted a point [r, z]",
    );
    refuses(
        &nurbs("1", "[[1, 2, 3], [3, 4, 5]]", ""),
        "vase.toml:5:11: profiles.ring.curves[0].points[0]: found [1, 2, 3], wanted a point [r, z]",
    );
    let many = format!("kind = \"bezier\"\npoints = [{}]\n", "[1, 2], ".repeat(34));
    refuses(
        &curves(&many),
        "vase.toml:4:10: profiles.ring.curves[0].points: found 34 points, wanted at most 33 points, for \
         degree 32",
    );
}

#[test]
fn weights_are_checked() {
    refuses(
        &nurbs("1", FOUR, "weights = [1, 1, 1]"),
        "vase.toml:6:11: profiles.ring.curves[0].weights: found 3 weights, wanted 4, one for each point",
    );
    for bad in ["0", "-0.5", "inf", "nan"] {
        refuses(
            &nurbs("1", FOUR, &format!("weights = [1, 1, 1, {bad}]")),
            &format!(
                "vase.toml:6:21: profiles.ring.curves[0].weights[3]: found {bad}, wanted a finite number \
                 greater than 0, at most 1e100"
            ),
        );
    }
}

#[test]
fn knots_are_checked() {
    let at = "profiles.ring.curves[0].knots";
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, 1, 1, 1]"),
        &format!("vase.toml:6:9: {at}: found 6 knots, wanted 7: 4 points + degree 2 + 1"),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, 0.5, 0.4, 1, 1]"),
        &format!(
            "vase.toml:6:24: {at}[4]: found 0.4, wanted a knot not below the one before it, 0.5"
        ),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, nan, 1, 1, 1]"),
        &format!(
            "vase.toml:6:19: {at}[3]: found nan, wanted a finite number of magnitude at most 1e100"
        ),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 1, 1, 1, 2, 2]"),
        &format!(
            "vase.toml:6:9: {at}: found a domain from 1.0 to 1.0, wanted knots with knots[2] below knots[4]"
        ),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, 0, 1, 1, 1]"),
        &format!("vase.toml:6:19: {at}[3]: found 0, wanted at most 3 equal knots for degree 2"),
    );
    let five = "[[1, 0], [2, 0], [2, 1], [2, 2], [1, 0]]";
    refuses(
        &nurbs("1", five, "knots = [0, 0, 0.5, 0.5, 0.5, 1, 1]"),
        &format!("vase.toml:6:26: {at}[4]: found 0.5, wanted at most 2 equal knots for degree 1"),
    );
    // Where degree + 1 are equal the curve may go on; whether it jumps is for the region to say.
    assert!(toml(&nurbs("1", five, "knots = [0, 0, 0.5, 0.5, 0.75, 1, 1]")).is_ok());
    for good in [
        "[0, 1, 2, 3, 4, 5, 6]",
        "[-1, -0.5, 0, 1e-9, 1, 1.5, 2]",
        "[0, 0, 0, 1, 2, 2, 2]",
    ] {
        assert!(toml(&nurbs("2", FOUR, &format!("knots = {good}"))).is_ok());
    }
}

#[test]
fn profiles_are_checked() {
    refuses(
        &small(
            "[[profiles",
            "[profiles.ring]\nboundary = \"to-axis\"\n[[profiles",
        )
        .replace("ring.curves", "other.curves"),
        "vase.toml:2:1: profiles.ring: found no key `curves`, wanted the open chain of a profile with \
         boundary to-axis",
    );
    refuses(
        &small("[[profiles.ring.curves]]", "[profiles.ring.curves]"),
        "vase.toml:2:1: profiles.ring.curves: found a table [profiles.ring.curves], wanted an array of at \
         least one curve; in toml write [[profiles.ring.curves]], with two brackets",
    );
    refuses(
        &small("[[profiles", "[profiles.ring]\nloops = [[]]\n[[profiles"),
        "vase.toml:3:10: profiles.ring.loops[0]: found [], wanted an array of at least one curve",
    );
    refuses(
        &full("fill = \"nonzero\"", "fill = \"non-zero\""),
        "vase.toml:23:8: profiles.chain.fill: found \"non-zero\", wanted one of even-odd, nonzero; did you \
         mean `nonzero`?",
    );
    refuses(
        &full("from = 350, to = 90", "from = 350, to = 350"),
        "vase.toml:47:66: profiles.\"my bowl\".loops[2][0].to: found 350, wanted an angle other than 350 \
         and within 360 of it",
    );
}
