//! Any text: refused or read, never a panic.

use super::*;

/// A change to a text: at a fraction of its length, some bytes out, some in.
fn changes() -> impl Strategy<Value = Vec<(f64, usize, String)>> {
    let piece = prop_oneof![
        prop::sample::select(vec![
            "",
            "-",
            "0",
            "9",
            "1e308",
            "nan",
            "null",
            "[",
            "]",
            "{",
            "}",
            "[[",
            "]]",
            "\"",
            "'",
            "\"\"\"",
            "\n",
            ",",
            ".",
            "=",
            ":",
            "#",
            "\\u",
            "\\",
            "é",
            "\u{feff}",
            "\u{0}",
            "schema = 1\n",
            "true",
            "1979-05-27",
            "0x",
            "_",
            "99999999999999999999",
            "points",
            "{ file = \"x\" }",
            "\"a\": ",
        ])
        .prop_map(str::to_owned),
        "\\PC{0,4}",
    ];
    proptest::collection::vec((0.0..1.0f64, 0..12usize, piece), 1..5)
}

fn change(text: &str, changes: &[(f64, usize, String)]) -> String {
    let mut text = text.to_owned();
    for (at, out, piece) in changes {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a position in a short text"
        )]
        let mut start = (at * text.len() as f64) as usize;
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        let mut end = (start + out).min(text.len());
        while !text.is_char_boundary(end) {
            end += 1;
        }
        text.replace_range(start..end, piece);
    }
    text
}

/// Whatever comes out is a scene that resolves to itself or an error on one short line.
fn check(result: Result<SceneModel, SceneError>) -> Result<(), TestCaseError> {
    match result {
        Ok(scene) => {
            let resolved = print(&scene);
            let again = json(&resolved).map_err(|e| TestCaseError::fail(e.to_string()))?;
            prop_assert_eq!(print(&again), resolved);
        }
        Err(error) => {
            let shown = error.to_string();
            prop_assert!(shown.lines().count() == 1 && shown.len() < 1500, "{shown}");
            if let Some((text, span)) = error.source_text() {
                prop_assert!(span.end <= text.len() && text.is_char_boundary(span.start));
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn broken_toml_never_panics(changes in changes()) {
        check(toml(&change(FULL, &changes)))?;
    }

    #[test]
    fn broken_json_never_panics(changes in changes()) {
        let text = print(&toml(FULL).expect("a valid scene"));
        check(json(&change(&text, &changes)))?;
    }

    #[test]
    fn any_set_never_panics(set in "[a-z\\[\\].0-9\"'= ]{0,12}=?\\PC{0,6}") {
        check(with_sets(FULL, &[&set]))?;
    }

    #[test]
    fn any_value_anywhere_never_panics(
        path in prop::sample::select(vec![
            "grid.spacing", "grid.dims", "profiles.chain.curves.1.knots", "solid.0.axis.x",
            "profiles.chain.curves.1.points", "profiles.chain.curves.3.degree", "solid.0.place",
            "profiles.my.loops", "solid.1.name", "materials.7", "output.band",
        ]),
        value in prop::sample::select(vec![
            "[]", "[[]]", "{}", "[{}]", "[1, 2, 3]", "[[1, 2], [3, 4]]", "-0.0", "1e-320", "1e100",
            "[1e100, 1e-100, 0]", "9223372036854775807", "0xffffffffffffffffff", "\"\"", "true",
        ]),
    ) {
        check(with_sets(FULL, &[&format!("{path}={value}")]))?;
    }

    #[test]
    fn any_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
        let text = String::from_utf8_lossy(&bytes);
        check(toml(&text))?;
        check(json(&text))?;
    }
}
