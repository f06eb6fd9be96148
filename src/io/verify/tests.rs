use super::*;
use crate::io::exr::SampleKind;
use crate::io::stack::tests::write_ramp;

#[test]
fn a_fresh_stack_is_intact() {
    let dir = tempfile::tempdir().unwrap();
    let manifest = write_ramp(dir.path(), 2, false);
    let report = verify_stack(dir.path()).unwrap();
    assert!(report.is_intact() && report.extra.is_empty());
    assert_eq!(report.manifest, manifest);
}

#[test]
fn flipped_bits_missing_and_extra_files_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let manifest = write_ramp(dir.path(), 2, false);
    let path = |name: &str| dir.path().join(name);
    let mut bytes = fs::read(path("slice-0001.exr")).unwrap();
    let at = bytes.len() - 5;
    bytes[at] ^= 4;
    fs::write(path("slice-0001.exr"), &bytes).unwrap();
    fs::write(path("slice-0002.exr"), "short").unwrap();
    fs::remove_file(path("slice-0003.exr")).unwrap();
    fs::remove_file(path("notes.txt")).unwrap();
    fs::create_dir(path("notes.txt")).unwrap();
    fs::write(path("extra.txt"), "").unwrap();
    fs::create_dir(path(".voxlathe-staging-x")).unwrap();
    let report = verify_stack(dir.path()).unwrap();
    assert!(!report.is_intact());
    assert_eq!(report.missing, ["slice-0003.exr"]);
    assert_eq!(report.extra, [".voxlathe-staging-x", "extra.txt"]);
    let found: Vec<_> = report
        .altered
        .iter()
        .map(|f| (f.name.as_str(), f.found_bytes, f.found_blake3.is_some()))
        .collect();
    assert_eq!(
        found,
        [
            ("slice-0001.exr", Some(bytes.len() as u64), true),
            ("slice-0002.exr", Some(5), false),
            ("notes.txt", None, false),
        ]
    );
    assert_eq!(report.altered[1].expected_bytes, manifest.files[2].bytes);
}

#[test]
fn what_is_no_stack_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        verify_stack(dir.path()).unwrap_err().to_string(),
        format!(
            "cannot read {}; check that it exists and that you may read it",
            dir.path().join("manifest.json").display()
        )
    );
}

/// Edits with the digest made anew: the slices know better.
#[test]
fn what_the_slices_contradict_is_found() {
    type Edit = fn(&mut crate::io::Manifest);
    let edits: [(&str, Edit); 27] = [
        ("origin", |m| m.grid.origin[1] += 1e-15),
        ("spacing", |m| m.grid.spacing[2] = 0.25),
        ("dims swapped", |m| m.grid.dims.swap(0, 1)),
        ("fewer layers", |m| {
            m.grid.dims[2] -= 1;
            m.files.remove(4);
        }),
        ("units", |m| m.units = "m".into()),
        ("unit of sdf", |m| m.channels[2].unit = Some("m".into())),
        ("sign", |m| m.sign_convention = "positive-inside".into()),
        ("type", |m| m.channels[0].kind = SampleKind::Float),
        ("channel renamed", |m| m.channels[2].name = "fdf".into()),
        ("channel left out", |m| drop(m.channels.remove(3))),
        ("least", |m| m.channels[2].range = Some([-1.5, 3.5])),
        ("no range", |m| m.channels[1].range = None),
        ("compression", |m| m.compression = Some("zip".into())),
        ("unknown compression", |m| {
            m.compression = Some("bogus".into())
        }),
        ("inside", |m| m.voxels_inside = Some(7)),
        ("not inside", |m| m.voxels_inside = None),
        ("occupancy", |m| m.volume_occupancy = Some(1.0)),
        ("fraction as stored", |m| {
            m.volume_fraction_stored = m.volume_fraction_stored.map(f64::next_up)
        }),
        ("fraction", |m| {
            m.volume_fraction = m.volume_fraction.map(|v| v * (1.0 + 1e-7))
        }),
        ("scene", |m| {
            m.scene = serde_json::json!({ "schema": 1, "x": 2 })
        }),
        ("scene's hash", |m| m.scene_hash = Some("0".repeat(64))),
        ("scene's name", |m| m.scene_name = Some("other".into())),
        ("version", |m| m.version = "9.9.9".into()),
        ("z", |m| m.files[2].z = Some(0.0)),
        ("order", |m| m.files.swap(0, 1)),
        ("slices exchanged", |m| {
            let (one, two) = (m.files[0].clone(), m.files[1].clone());
            m.files[0] = FileRecord {
                slice: Some(0),
                z: one.z,
                ..two
            };
            m.files[1] = FileRecord {
                slice: Some(1),
                z: m.files[1].z,
                ..one
            };
        }),
        ("bounds", |m| m.bounds = Some([[1.0; 3], [0.0; 3]])),
    ];
    let dir = tempfile::tempdir().unwrap();
    let manifest = write_ramp(dir.path(), 2, false);
    for (name, edit) in edits {
        let mut edited = manifest.clone();
        edit(&mut edited);
        assert_ne!(edited, manifest, "{name}");
        fs::write(dir.path().join(MANIFEST_NAME), edited.to_bytes().unwrap()).unwrap();
        let found = verify_stack(dir.path());
        assert!(found.is_ok_and(|report| !report.is_intact()), "{name}");
    }
    fs::write(dir.path().join(MANIFEST_NAME), manifest.to_bytes().unwrap()).unwrap();
    assert!(verify_stack(dir.path()).unwrap().is_intact());
}

/// Every bit of a slice, of another file and of the manifest.
#[test]
fn every_flipped_bit_of_a_stack_is_found() {
    let dir = tempfile::tempdir().unwrap();
    write_ramp(dir.path(), 1, false);
    for name in ["slice-0002.exr", "notes.txt", MANIFEST_NAME] {
        let file = dir.path().join(name);
        let good = fs::read(&file).unwrap();
        for at in 0..good.len() {
            let mut bytes = good.clone();
            bytes[at] ^= 1 << (at % 8);
            fs::write(&file, bytes).unwrap();
            let found = verify_stack(dir.path());
            assert!(
                !found.is_ok_and(|report| report.is_intact()),
                "{name}, byte {at}"
            );
        }
        fs::write(&file, good).unwrap();
    }
}
