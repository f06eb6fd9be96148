use super::*;
use crate::io::{manifest, write_file_atomically};

fn listing(path: &Path) -> Vec<String> {
    let mut names = entries(path).unwrap();
    names.sort();
    names
}

fn old_manifest(names: &[&str]) -> String {
    let hash = blake3::hash(b"old").to_hex().to_string();
    let files: Vec<_> = names
        .iter()
        .map(|n| serde_json::json!({ "name": n, "bytes": 3, "blake3": hash }))
        .collect();
    let object = serde_json::json!({ "format": "voxlathe-stack", "files": files });
    let object = serde_json::to_vec_pretty(&object).unwrap();
    String::from_utf8(manifest::with_digest(object)).unwrap()
}

#[test]
fn files_appear_at_the_commit_and_nothing_else_does() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("a/b/out");
    let stack = StackDirectory::create(&out, false).unwrap();
    std::thread::scope(|scope| {
        for n in 0..8 {
            let stack = &stack;
            scope.spawn(move || {
                let written = stack
                    .write_file(&format!("slice-{n:04}.exr"), &[n; 3])
                    .unwrap();
                assert_eq!(written.bytes, 3);
                assert_eq!(written.blake3, blake3::hash(&[n; 3]).to_hex().as_str());
            });
        }
    });
    assert!(listing(&out).iter().all(|n| is_staging(n)));
    stack.commit(b"{}\n").unwrap();
    let names = listing(&out);
    assert_eq!(names.len(), 9);
    assert_eq!(names[0], "manifest.json");
    assert_eq!(fs::read(out.join("slice-0005.exr")).unwrap(), [5; 3]);
    assert_eq!(fs::read(out.join("manifest.json")).unwrap(), b"{}\n");
}

#[test]
fn drop_leaves_no_trace() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("a/out");
    let stack = StackDirectory::create(&out, false).unwrap();
    stack.write_file("slice-0000.exr", b"x").unwrap();
    drop(stack);
    assert!(listing(root.path()).is_empty());

    // With force, the old stack stays whole.
    fs::create_dir_all(&out).unwrap();
    fs::write(out.join("manifest.json"), old_manifest(&["slice-0000.exr"])).unwrap();
    fs::write(out.join("slice-0000.exr"), "old").unwrap();
    let stack = StackDirectory::create(&out, true).unwrap();
    stack.write_file("slice-0000.exr", b"new").unwrap();
    drop(stack);
    assert_eq!(listing(&out), ["manifest.json", "slice-0000.exr"]);
    assert_eq!(fs::read(out.join("slice-0000.exr")).unwrap(), b"old");
}

#[test]
fn a_commit_that_fails_brings_the_old_stack_back() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    fs::create_dir_all(&out).unwrap();
    let manifest = old_manifest(&["slice-0000.exr", "slice-0001.exr"]);
    fs::write(out.join("manifest.json"), &manifest).unwrap();
    for name in ["slice-0000.exr", "slice-0001.exr"] {
        fs::write(out.join(name), "old").unwrap();
    }
    let stack = StackDirectory::create(&out, true).unwrap();
    stack.write_file("slice-0000.exr", b"new").unwrap();
    // Somebody puts a directory where an old slice was.
    fs::remove_file(out.join("slice-0001.exr")).unwrap();
    fs::create_dir(out.join("slice-0001.exr")).unwrap();
    let error = stack.commit(b"{}\n").unwrap_err();
    assert!(matches!(error, IoError::FileName { .. }), "{error}");
    assert_eq!(
        listing(&out),
        ["manifest.json", "slice-0000.exr", "slice-0001.exr"]
    );
    assert_eq!(fs::read(out.join("slice-0000.exr")).unwrap(), b"old");
    assert_eq!(
        fs::read(out.join("manifest.json")).unwrap(),
        manifest.as_bytes()
    );
}

#[test]
fn a_full_directory_is_refused_without_force() {
    let out = tempfile::tempdir().unwrap();
    fs::write(out.path().join("notes.txt"), "mine").unwrap();
    let error = StackDirectory::create(out.path(), false).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "{} is not empty (1 entry); choose another output directory, or give --force to replace the stack in it",
            out.path().display()
        )
    );
    assert_eq!(listing(out.path()), ["notes.txt"]);
    let file = out.path().join("notes.txt");
    assert_eq!(
        StackDirectory::create(&file, true).unwrap_err().to_string(),
        format!(
            "{} exists and is not a directory; choose another output directory",
            file.display()
        )
    );
    assert!(StackDirectory::create(file.join("deeper"), true).is_err());
}

#[test]
fn force_removes_the_old_stack_and_nothing_more() {
    let out = tempfile::tempdir().unwrap();
    let path = out.path();
    for name in [
        "slice-0000.exr",
        "slice-0001.exr",
        "slice-12345.exr",
        "volume.raw",
    ] {
        fs::write(path.join(name), "old").unwrap();
    }
    for name in [
        "notes.txt",
        "slice-001.exr",
        "slice-000a.exr",
        "xslice-0000.exr",
    ] {
        fs::write(path.join(name), "mine").unwrap();
    }
    fs::write(
        path.join("manifest.json"),
        old_manifest(&["slice-0000.exr", "volume.raw", "gone.raw"]),
    )
    .unwrap();
    fs::create_dir(path.join(".voxlathe-staging")).unwrap();
    fs::write(path.join(".voxlathe-staging/slice-0000.exr"), "half").unwrap();
    let stack = StackDirectory::create(path, true).unwrap();
    stack.write_file("slice-0000.exr", b"new").unwrap();
    assert!(matches!(
        stack.write_file("notes.txt", b"new"),
        Err(IoError::Occupied { .. })
    ));
    stack.commit(b"{}\n").unwrap();
    assert_eq!(
        listing(path),
        [
            "manifest.json",
            "notes.txt",
            "slice-0000.exr",
            "slice-000a.exr",
            "slice-001.exr",
            "xslice-0000.exr"
        ]
    );
    assert_eq!(fs::read(path.join("slice-0000.exr")).unwrap(), b"new");
    assert_eq!(fs::read(path.join("notes.txt")).unwrap(), b"mine");
}

#[test]
fn hostile_manifests_reach_nothing_outside() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    fs::create_dir(&out).unwrap();
    let victim = root.path().join("victim");
    fs::write(&victim, "precious").unwrap();
    let absolute = victim.to_str().unwrap();
    for name in [
        "../victim",
        "..",
        ".",
        "",
        "a/../../victim",
        "sub//file",
        "sub/",
        "sub/.hidden",
        "1/2/3/4/5/6/7/8/9",
        "a\\b",
        "nul\0byte",
        "line\nbreak",
        ".hidden",
        "manifest.json",
        "C:victim",
        absolute,
    ] {
        fs::write(out.join("manifest.json"), old_manifest(&[name])).unwrap();
        let error = StackDirectory::create(&out, true).unwrap_err();
        assert!(
            matches!(error, IoError::FileName { .. }),
            "{name:?}: {error}"
        );
        assert_eq!(listing(&out), ["manifest.json"]);
    }
    #[cfg(unix)]
    for name in ["link.raw", "slice-0000.exr"] {
        std::os::unix::fs::symlink(&victim, out.join(name)).unwrap();
        fs::write(out.join("manifest.json"), old_manifest(&[name])).unwrap();
        let error = StackDirectory::create(&out, true).unwrap_err().to_string();
        assert_eq!(
            error,
            format!(
                "{}: the file name {name:?} is not a regular file; remove that entry by hand, or use another directory",
                out.display()
            )
        );
        fs::remove_file(out.join(name)).unwrap();
    }
    fs::create_dir(out.join("slice-0000.exr")).unwrap();
    assert!(StackDirectory::create(&out, true).is_err());
    fs::remove_dir(out.join("slice-0000.exr")).unwrap();
    for text in [
        "{}",
        "[",
        "{\"format\":\"extension\",\"files\":[]}",
        "\u{0}",
    ] {
        fs::write(out.join("manifest.json"), text).unwrap();
        let error = StackDirectory::create(&out, true).unwrap_err();
        assert!(
            matches!(error, IoError::ForeignManifest { .. }),
            "{text}: {error}"
        );
        assert_eq!(fs::read_to_string(out.join("manifest.json")).unwrap(), text);
    }
    assert_eq!(fs::read(&victim).unwrap(), b"precious");
}

#[test]
fn a_living_run_is_not_swept_away() {
    let out = tempfile::tempdir().unwrap();
    let first = StackDirectory::create(out.path(), false).unwrap();
    for force in [false, true] {
        assert!(matches!(
            StackDirectory::create(out.path(), force),
            Err(IoError::InUse { .. })
        ));
    }
    first.write_file("slice-0000.exr", b"x").unwrap();
    // A file that comes during the run is not overwritten.
    fs::write(out.path().join("slice-0000.exr"), "mine").unwrap();
    assert!(matches!(first.commit(b"{}"), Err(IoError::NotEmpty { .. })));
    assert_eq!(listing(out.path()), ["slice-0000.exr"]);
    assert_eq!(
        fs::read(out.path().join("slice-0000.exr")).unwrap(),
        b"mine"
    );
}

#[test]
fn names_are_plain_and_written_once() {
    let out = tempfile::tempdir().unwrap();
    let stack = StackDirectory::create(out.path(), false).unwrap();
    for name in ["../x", "/x", "a/../b", "a/", "", "..", "manifest.json"] {
        assert!(matches!(
            stack.write_file(name, b""),
            Err(IoError::FileName { .. })
        ));
    }
    for name in ["x", "a/b"] {
        stack.write_file(name, b"").unwrap();
        assert!(matches!(
            stack.write_file(name, b""),
            Err(IoError::WrittenTwice { .. })
        ));
    }
}

/// Files in directories go and come as others do, and so do the directories; what is foreign stays where it is.
#[test]
fn files_in_directories_are_replaced_as_others() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let stack = |force, names: &[&str]| {
        let stack = StackDirectory::create(&out, force).unwrap();
        for name in names {
            stack.write_file(name, b"old").unwrap();
        }
        stack.commit(old_manifest(names).as_bytes()).unwrap();
    };
    let listed = || {
        let opened = ["t/a/1", "t/b/1", "u/1"];
        let mut found = files_below(&out, opened.into_iter()).unwrap();
        found.sort();
        found
            .iter()
            .map(|f| f.display().to_string())
            .collect::<Vec<_>>()
    };
    stack(false, &["t/a/1", "t/a/2", "t/b/1"]);
    assert_eq!(listed(), ["manifest.json", "t/a/1", "t/a/2", "t/b/1"]);
    stack(true, &["t/a/1", "u/1"]);
    assert_eq!(listed(), ["manifest.json", "t/a/1", "u/1"]);
    assert!(!out.join("t/b").exists());
    // By the journal.
    fs::write(out.join("t/a/mine"), "mine").unwrap();
    stack(true, &["t/b/1"]);
    assert_eq!(listed(), ["manifest.json", "t/a/mine", "t/b/1"]);
    assert!(!out.join("u").exists());
    // A failure at the end brings back what was there.
    let failing = StackDirectory::create(&out, true).unwrap();
    failing.write_file("t/a/1", b"new").unwrap();
    failing.write_file("u/1", b"new").unwrap();
    fs::write(out.join("u"), "in the way").unwrap();
    assert!(matches!(
        failing.commit(b"{}"),
        Err(IoError::Occupied { .. })
    ));
    assert_eq!(listed(), ["manifest.json", "t/a/mine", "t/b/1", "u"]);
    // Nor is anything written into a directory that is not the stack's.
    fs::remove_file(out.join("u")).unwrap();
    fs::create_dir(out.join("u")).unwrap();
    let refused = StackDirectory::create(&out, true).unwrap();
    let error = refused.write_file("u/1", b"new").unwrap_err();
    assert!(matches!(error, IoError::Occupied { .. }), "{error}");
    assert_eq!(listing(root.path()), ["out"]);
}

/// A listed name that leads through a link would reach files elsewhere.
#[cfg(unix)]
#[test]
fn names_do_not_lead_through_links() {
    let root = tempfile::tempdir().unwrap();
    let (out, other) = (root.path().join("out"), root.path().join("other"));
    write_all(&other, &[("file", "old")]);
    fs::create_dir(&out).unwrap();
    std::os::unix::fs::symlink(&other, out.join("link")).unwrap();
    fs::write(out.join("manifest.json"), old_manifest(&["link/file"])).unwrap();
    let error = StackDirectory::create(&out, true).unwrap_err();
    assert!(matches!(error, IoError::FileName { .. }), "{error}");
    assert_eq!(fs::read(other.join("file")).unwrap(), b"old");
}

#[test]
fn free_space_is_told_for_paths_that_do_not_exist_yet() {
    let out = tempfile::tempdir().unwrap();
    let here = available_bytes(out.path()).unwrap();
    let there = available_bytes(out.path().join("not/yet")).unwrap();
    assert!(here > 0 && there > 0);
    assert!(available_bytes("not/yet/at/all").unwrap() > 0);
}

#[test]
fn single_files_are_whole_or_as_before() {
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("points.csv");
    write_file_atomically(&file, |w| w.write_all(b"one")).unwrap();
    let failed = write_file_atomically(&file, |w| {
        w.write_all(b"two")?;
        Err(io::ErrorKind::StorageFull.into())
    });
    assert!(matches!(failed, Err(IoError::Write { .. })));
    assert_eq!(fs::read(&file).unwrap(), b"one");
    assert_eq!(listing(out.path()), ["points.csv"]);
    let missing = out.path().join("no/such/points.csv");
    assert_eq!(
        write_file_atomically(&missing, |_| Ok(()))
            .unwrap_err()
            .to_string(),
        format!(
            "cannot write {}; check its permissions and the free space, then run again",
            missing.display()
        )
    );
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let link = out.path().join("link.csv");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_file_atomically(&link, |w| w.write_all(b"three")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"three");
        let mode = fs::metadata(&file).unwrap().permissions().mode();
        assert_eq!(mode & 0o600, 0o600);
        write_file_atomically("/dev/null", |w| w.write_all(b"x")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}

/// The files of a directory and what is in them.
fn contents(path: &Path) -> Vec<(String, Vec<u8>)> {
    let names = listing(path);
    let read = |name: String| {
        let bytes = fs::read(path.join(&name)).unwrap();
        (name, bytes)
    };
    names.into_iter().map(read).collect()
}

fn write_all(path: &Path, files: &[(&str, &str)]) {
    fs::create_dir_all(path).unwrap();
    for (name, text) in files {
        fs::write(path.join(name), text).unwrap();
    }
}

/// Old and new files that share names and do not, each state between them, both ways, and again.
#[test]
fn a_replacement_can_be_finished_or_undone_wherever_it_stopped() {
    const OLD_FILES: [(&str, &str); 4] = [
        ("manifest.json", "old m"),
        ("a", "old a"),
        ("b", "old b"),
        ("mine", "mine"),
    ];
    const NEW_FILES: [(&str, &str); 3] =
        [("b", "new b"), ("c", "new c"), ("manifest.json", "new m")];
    const MOVES: usize = 3 + 3;
    let names = |list: &[(&str, &str)]| list.iter().map(|f| f.0.to_owned()).collect::<Vec<_>>();
    let root = tempfile::tempdir().unwrap();
    let [old, new] = [root.path().join("o"), root.path().join("n")];
    write_all(&old, &OLD_FILES);
    write_all(&new, &NEW_FILES);
    write_all(&new, &[("mine", "mine")]);
    let (old, new) = (contents(&old), contents(&new));
    let made = |out: &Path, moves: usize| {
        let staging = out.join(STAGING);
        write_all(out, &OLD_FILES);
        write_all(&staging.join("new"), &NEW_FILES);
        fs::create_dir(staging.join("old")).unwrap();
        let journal = Journal::new(names(&NEW_FILES), names(&OLD_FILES[..3]));
        journal.write(&staging).unwrap();
        for (name, _) in &OLD_FILES[..moves.min(3)] {
            fs::rename(out.join(name), staging.join("old").join(name)).unwrap();
        }
        for (name, _) in &NEW_FILES[..moves.saturating_sub(3)] {
            fs::rename(staging.join("new").join(name), out.join(name)).unwrap();
        }
        (journal, staging)
    };
    for moves in 0..=MOVES {
        // As a reader finds it: finished.
        let out = root.path().join(format!("read-{moves}"));
        let (journal, staging) = made(&out, moves);
        recover(&out).unwrap();
        assert!(!is_unsettled(&out) && !exists(&staging), "{moves} moves");
        assert_eq!(contents(&out), new, "{moves} moves");
        assert!(!journal.is_fresh());
        // Back and forth, and each twice.
        let out = root.path().join(format!("both-{moves}"));
        let (journal, staging) = made(&out, moves);
        let held = |path: &Path| {
            let mut held = listing(path);
            held.retain(|name| !is_staging(name));
            held.into_iter()
                .map(|name| (name.clone(), fs::read(path.join(name)).unwrap()))
                .collect::<Vec<_>>()
        };
        for _ in 0..2 {
            for _ in 0..2 {
                journal.go_back(&out, &staging).unwrap();
                assert_eq!(held(&out), old, "back after {moves} moves");
            }
            for _ in 0..2 {
                journal.go_forward(&out, &staging).unwrap();
                assert_eq!(held(&out), new, "forward after {moves} moves");
            }
        }
        // The next run finds the wish to have the old ones back.
        let out = root.path().join(format!("back-{moves}"));
        let (_, staging) = made(&out, moves);
        Journal::turn_back(&staging).unwrap();
        drop(StackDirectory::create_for(&out, &["none"], true).unwrap());
        assert_eq!(contents(&out), old, "{moves} moves");
    }
}

#[test]
fn a_first_stack_that_was_not_finished_makes_way_for_the_same_command() {
    for placed in 0..=2 {
        let out = tempfile::tempdir().unwrap();
        let staging = out.path().join(STAGING);
        let names = ["slice-0000.exr", "manifest.json"];
        write_all(&staging.join("new"), &[(names[0], "s"), (names[1], "m")]);
        let journal = Journal::new(names.map(str::to_owned).to_vec(), Vec::new());
        journal.write(&staging).unwrap();
        for name in &names[..placed] {
            fs::rename(staging.join("new").join(name), out.path().join(name)).unwrap();
        }
        let stack = StackDirectory::create(out.path(), false).unwrap();
        assert_eq!(listing(out.path()), [STAGING]);
        stack.commit(b"{}").unwrap();
        assert_eq!(listing(out.path()), ["manifest.json"]);
    }
}

#[test]
fn hostile_journals_move_nothing() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    fs::write(root.path().join("victim"), "precious").unwrap();
    let staging = out.join(STAGING);
    for text in [
        r#"{"format":"voxlathe-journal","new":[],"old":["../victim"]}"#,
        r#"{"format":"voxlathe-journal","new":[".voxlathe-staging"],"old":[]}"#,
        r#"{"format":"other","new":[],"old":[]}"#,
        r#"{"format":"voxlathe-journal","new":[],"old":[],"more":1}"#,
        "",
        "[[[[",
    ] {
        fs::create_dir_all(staging.join("new")).unwrap();
        fs::write(staging.join("journal"), text).unwrap();
        for force in [false, true] {
            let error = StackDirectory::create(&out, force).unwrap_err();
            assert!(
                matches!(error, IoError::Unsettled { .. }),
                "{text}: {error}"
            );
        }
        assert!(recover(&out).is_err());
        assert_eq!(fs::read_to_string(staging.join("journal")).unwrap(), text);
    }
    assert_eq!(listing(root.path()), ["out", "victim"]);
    // A link in the place of the staging directory is not followed.
    fs::remove_dir_all(&staging).unwrap();
    std::os::unix::fs::symlink(root.path(), &staging).unwrap();
    let error = StackDirectory::create(&out, true).unwrap_err();
    assert!(matches!(error, IoError::Occupied { .. }), "{error}");
    assert_eq!(listing(root.path()), ["out", "victim"]);
}

#[test]
fn edited_files_are_refused_before_and_after_the_work() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let manifest = old_manifest(&["slice-0000.exr", "notes.txt"]);
    write_all(&out, &[("slice-0000.exr", "old"), ("notes.txt", "old")]);
    fs::write(out.join("manifest.json"), &manifest).unwrap();
    for text in ["new", "longer"] {
        fs::write(out.join("notes.txt"), text).unwrap();
        let error = StackDirectory::create(&out, true).unwrap_err();
        assert!(
            matches!(&error, IoError::Edited { path } if *path == out.join("notes.txt")),
            "{error}"
        );
        assert_eq!(error.kind(), crate::io::IoErrorKind::BadInput);
    }
    // One that is edited, or comes, while the stack is being made.
    for name in ["notes.txt", "slice-0000.exr", "manifest.json"] {
        fs::write(out.join("notes.txt"), "old").unwrap();
        fs::write(out.join("slice-0000.exr"), "old").unwrap();
        fs::write(out.join("manifest.json"), &manifest).unwrap();
        let stack = StackDirectory::create(&out, true).unwrap();
        stack.write_file("slice-0000.exr", b"new").unwrap();
        fs::write(out.join(name), "mine now").unwrap();
        let error = stack.commit(b"{}").unwrap_err();
        assert!(matches!(error, IoError::Edited { .. }), "{error}");
        assert_eq!(fs::read(out.join(name)).unwrap(), b"mine now");
        assert_eq!(listing(&out).len(), 3);
    }
}

/// Nothing foreign: one step. A file that comes at the last moment stays.
#[cfg(target_os = "linux")]
#[test]
fn a_directory_is_exchanged_in_one_step_where_it_can_be() {
    use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let inode = |path: &Path| fs::metadata(path).unwrap().ino();
    let old = |out: &Path| {
        write_all(out, &[("slice-0000.exr", "old"), ("slice-0001.exr", "old")]);
        let manifest = old_manifest(&["slice-0000.exr", "slice-0001.exr"]);
        fs::write(out.join("manifest.json"), manifest).unwrap();
    };
    let replace = |out: &Path| {
        let before = inode(out);
        let stack = StackDirectory::create(out, true).unwrap();
        stack.write_file("slice-0000.exr", b"new").unwrap();
        stack.commit(b"{}").unwrap();
        assert_eq!(fs::read(out.join("slice-0000.exr")).unwrap(), b"new");
        before != inode(out)
    };
    old(&out);
    fs::set_permissions(&out, fs::Permissions::from_mode(0o751)).unwrap();
    assert!(replace(&out), "exchanged");
    assert_eq!(fs::metadata(&out).unwrap().mode() & 0o7777, 0o751);
    assert_eq!(listing(&out), ["manifest.json", "slice-0000.exr"]);
    assert_eq!(listing(root.path()), ["out"]);
    // A foreign file, a link: the journal does it.
    fs::remove_dir_all(&out).unwrap();
    old(&out);
    fs::write(out.join("mine"), "mine").unwrap();
    assert!(!replace(&out), "by the journal");
    assert_eq!(listing(&out), ["manifest.json", "mine", "slice-0000.exr"]);
    fs::remove_dir_all(&out).unwrap();
    old(&out);
    let link = root.path().join("link");
    std::os::unix::fs::symlink(&out, &link).unwrap();
    assert!(!replace(&link.join("")), "by the journal");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(listing(root.path()), ["link", "out"]);
    // What a killed run has put aside is swept, but for what is foreign in it.
    let other = exchange::Places::of(&out).unwrap().other;
    old(&other);
    write_all(&other.join(STAGING), &[]);
    fs::write(other.join("late"), "mine").unwrap();
    fs::remove_dir_all(&out).unwrap();
    old(&out);
    drop(StackDirectory::create(&out, true).unwrap());
    assert_eq!(listing(root.path()), ["link", "out"]);
    assert_eq!(fs::read(out.join("late")).unwrap(), b"mine");
}

/// Nobody can be told of it but the system: the lock is that of an open file.
#[test]
fn leftovers_of_single_files_are_swept_and_living_ones_are_not() {
    let out = tempfile::tempdir().unwrap();
    let file = out.path().join("points.csv");
    let mut first = true;
    write_file_atomically(&file, |w| {
        let own = listing(out.path());
        assert_eq!(own.len(), 1);
        if std::mem::take(&mut first) {
            // Another run with the same output, while this one lives, and what a third has left.
            let dead = format!("{}dead", &own[0][..own[0].len() - 6]);
            fs::write(out.path().join(&dead), "half").unwrap();
            write_file_atomically(&file, |w| w.write_all(b"two")).unwrap();
            assert_eq!(listing(out.path()), [own[0].as_str(), "points.csv"]);
        }
        w.write_all(b"one")
    })
    .unwrap();
    assert_eq!(fs::read(&file).unwrap(), b"one");
    assert_eq!(listing(out.path()), ["points.csv"]);
}

/// Killed between the last rename and the removal of the staging directory.
#[test]
fn what_is_dead_goes_although_the_directory_is_refused() {
    let out = tempfile::tempdir().unwrap();
    write_all(out.path(), &[("manifest.json", "{}")]);
    write_all(&out.path().join(STAGING).join("old"), &[("a", "old")]);
    let error = StackDirectory::create(out.path(), false).unwrap_err();
    assert!(
        matches!(error, IoError::NotEmpty { entries: 1, .. }),
        "{error}"
    );
    assert_eq!(listing(out.path()), ["manifest.json"]);
}
