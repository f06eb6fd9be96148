//! Text that is no scene at all.

use super::*;

#[test]
fn text_that_is_no_toml_is_refused_where_it_goes_wrong() {
    let error = toml("schema = 1\nunits = mm\n").expect_err("no toml");
    let problem = error.problem().expect("a bad text");
    assert_eq!((problem.line, problem.column), (2, 9));
    let (text, span) = error.source_text().expect("a bad text");
    assert!(text[span].starts_with("mm"));
    for bad in [
        "schema = ",
        "= 1",
        "[",
        "[[solid",
        "a = \"",
        "\u{0}",
        "a = [1, ",
        "x",
    ] {
        let error = toml(bad).expect_err(bad);
        let shown = error.to_string();
        assert!(
            shown.contains("valid toml (") && !shown.contains('\n'),
            "{shown}"
        );
    }
}

#[test]
fn hostile_text_is_refused() {
    for open in ["[", "{a=", "[{a=["] {
        assert!(toml(&format!("a = {}", open.repeat(100_000))).is_err());
    }
    assert!(toml(&format!("{} = 1", vec!["a"; 100_000].join("."))).is_err());
    // Dotted keys nest without a bracket: 70 times 70 levels. Reading and dropping that took more
    // stack than a thread of the test runner has.
    let key = ["a"; 70].join(".");
    let open = format!("{{ {key} = ").repeat(70);
    let deep = format!("{key} = {open}1{}", " }".repeat(70));
    let shown = message(toml(&deep));
    assert!(shown.contains("deeper nesting"), "{shown}");
    assert!(message(with_sets(SMALL, &[&deep])).contains("found"));
    let long = "x".repeat(1 << 20);
    let shown = message(toml(&small(
        "schema = 1",
        &format!("schema = 1\n{long} = 1"),
    )));
    assert!(shown.len() < 400, "{shown}");
    let shown = message(with_sets(SMALL, &[&format!("name=[\"{long}\"]")]));
    assert!(shown.len() < 400, "{shown}");
    // Time must not grow with the square of the number of keys.
    let many: String = (0..100_000).map(|i| format!("k{i} = 1\n")).collect();
    assert!(toml(&format!("schema = 1\n[profiles]\n{many}")).is_err());
    let many: String = (1..50_000).map(|i| format!("{i} = \"m\"\n")).collect();
    assert!(toml(&format!("{SMALL}[materials]\n{many}")).is_ok());
}

#[test]
fn too_much_text_is_refused() {
    let text = " ".repeat(MAX_TEXT_BYTES + 1);
    for format in [SceneFormat::Toml, SceneFormat::Json] {
        let error = parse_model(&text, format, "big.toml", Path::new(""), &[]);
        assert_eq!(
            message(error),
            "big.toml:1:1: found more text, wanted at most 67108864 bytes"
        );
    }
}
