//! What a slice's bytes are, and what other readers and writers make of them.

use super::super::header::{header_entries, sort_header};
use super::super::testing::{Layer, SIZE, attributes, grid};
use super::super::{Attribute, DecodedSamples, decode_layer};
use super::*;
use half::f16;

#[test]
fn every_compression_and_channel_comes_back() {
    let layer = Layer::ball(SIZE);
    for compression in Compression::ALL {
        let list = layer.channels();
        let bytes = encode_layer(SIZE, &list, &attributes(), compression).unwrap();
        let found = decode_layer(&bytes).unwrap();
        assert_eq!(found.size, SIZE);
        let names: Vec<_> = found.channels.iter().map(|c| c.0.as_str()).collect();
        assert_eq!(names, ["fraction", "material", "occupancy", "sdf"]);
        assert_eq!(
            found.channel("material"),
            Some(&DecodedSamples::Uint(layer.material.clone())),
            "{compression}"
        );
        let occupancy = layer.occupancy.iter().map(|&v| f16::from(v)).collect();
        assert_eq!(
            found.channel("occupancy"),
            Some(&DecodedSamples::Half(occupancy)),
            "{compression}"
        );
        for (name, wanted) in [("sdf", &layer.sdf), ("fraction", &layer.fraction)] {
            let values = found.channel(name).unwrap().to_f32();
            let allowed = if compression == Compression::Pxr24 {
                1.0 / 65536.0
            } else {
                0.0
            };
            for (a, b) in values.iter().zip(wanted) {
                assert!(
                    (a - b).abs() <= allowed * b.abs(),
                    "{compression} {name}: {a} is not {b}"
                );
            }
        }
        assert_eq!(found.attributes["voxlathe:slice"], Attribute::Int(3));
    }
}

#[test]
fn every_single_channel_and_odd_size_comes_back() {
    for size in [[1, 1], [1, 67], [67, 1], [33, 17]] {
        let layer = Layer::ball(size);
        for compression in Compression::ALL {
            for (name, samples) in layer.channels() {
                let bytes = encode_layer(size, &[(name, samples)], &Attributes::new(), compression)
                    .unwrap();
                let found = decode_layer(&bytes).unwrap();
                assert_eq!(found.size, size);
                assert_eq!(found.channels[0].0, name);
                assert_eq!(found.channels[0].1.kind(), samples.kind());
            }
        }
    }
}

#[test]
fn constant_layers_come_back_however_small_the_file() {
    let zeros = vec![0.0_f32; 1024 * 1024];
    let list = [("fraction", Samples::Float(&zeros))];
    for compression in Compression::ALL {
        let bytes = encode_layer([1024, 1024], &list, &Attributes::new(), compression).unwrap();
        let found = decode_layer(&bytes).unwrap();
        assert!(found.channel("fraction") == Some(&DecodedSamples::Float(zeros.clone())));
    }
}

#[test]
fn special_floats_keep_their_bits() {
    let sdf = [
        f32::INFINITY,
        f32::NEG_INFINITY,
        -0.0,
        f32::from_bits(1),
        f32::MAX,
        f32::MIN_POSITIVE,
    ];
    for compression in Compression::ALL {
        if compression == Compression::Pxr24 {
            continue;
        }
        let list = [("sdf", Samples::Float(&sdf))];
        let bytes = encode_layer([3, 2], &list, &Attributes::new(), compression).unwrap();
        let found = decode_layer(&bytes)
            .unwrap()
            .channel("sdf")
            .unwrap()
            .to_f32();
        let bits = |s: &[f32]| s.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(&sdf), "{compression}");
    }
}

#[test]
fn attributes_say_where_the_layer_is() {
    let layer = Layer::ball(SIZE);
    let bytes = encode_layer(SIZE, &layer.channels(), &attributes(), Compression::Zip).unwrap();
    let found = decode_layer(&bytes).unwrap().attributes;
    let text = |s: &str| Attribute::Text(s.into());
    let wanted = [
        ("voxlathe:dims", text("7 13 5")),
        (
            "voxlathe:origin",
            text("-0.10000000000000001 0 9.9999999999999995e-08"),
        ),
        ("voxlathe:scene", text("tour \\u{e9}")),
        ("voxlathe:sceneHash", text("abc123")),
        ("voxlathe:signConvention", text("negative-inside")),
        ("voxlathe:slice", Attribute::Int(3)),
        (
            "voxlathe:spacing",
            text("0.29999999999999999 0.29999999999999999 0.29999999999999999"),
        ),
        ("voxlathe:units", text("mm")),
        ("voxlathe:z", Attribute::Double(grid().centre_along(2, 3))),
    ];
    let found: Vec<_> = found.iter().map(|(n, v)| (n.as_str(), v.clone())).collect();
    assert_eq!(found, wanted);
}

#[test]
fn header_is_sorted_and_chunk_offsets_are_right() {
    let layer = Layer::ball([7, 67]);
    let mut many = attributes();
    for n in 0..40 {
        many.insert(format!("user:attribute{n:02}"), Attribute::Int(n));
    }
    for compression in Compression::ALL {
        let bytes = encode_layer([7, 67], &layer.channels(), &many, compression).unwrap();
        let (entries, end) = header_entries(&bytes).unwrap();
        assert!(entries.len() > 50);
        assert!(
            entries.windows(2).all(|w| w[0].0 < w[1].0),
            "sorted, no duplicates"
        );
        let lines = compression.resolve(["sdf"]).to_exr().scan_lines_per_block();
        let mut at = end + 1 + 8 * 67_usize.div_ceil(lines);
        for (n, y) in (0..67).step_by(lines).enumerate() {
            let slot = end + 1 + 8 * n;
            let offset = u64::from_le_bytes(bytes[slot..slot + 8].try_into().unwrap());
            assert_eq!(offset, at as u64, "{compression}, block {n}");
            let int = |p: usize| i32::from_le_bytes(bytes[p..p + 4].try_into().unwrap());
            assert_eq!(int(at), y);
            at += 8 + usize::try_from(int(at + 4)).unwrap();
        }
        assert_eq!(at, bytes.len());
    }
}

#[test]
fn equal_layers_give_equal_bytes() {
    let layer = Layer::ball(SIZE);
    let mut many = attributes();
    for n in 0..40 {
        many.insert(format!("user:attribute{n:02}"), Attribute::Int(n));
    }
    let list = layer.channels();
    let mut reversed = list;
    reversed.reverse();
    let first = encode_layer(SIZE, &list, &many, Compression::Zip).unwrap();
    for _ in 0..20 {
        // Every hash map of the process has its own seed, so each round shuffles anew.
        assert_eq!(
            encode_layer(SIZE, &list, &many, Compression::Zip).unwrap(),
            first
        );
    }
    assert_eq!(
        encode_layer(SIZE, &reversed, &many, Compression::Zip).unwrap(),
        first
    );
}

/// Writes a layer where the parent test wants it; alone it does nothing.
#[test]
#[ignore = "the child half of separate_processes_give_equal_bytes"]
fn layer_child() {
    let Some(file) = std::env::var_os("VOXLATHE_TEST_OUT") else {
        return;
    };
    let layer = Layer::ball(SIZE);
    let list = layer.channels();
    let bytes = encode_layer(SIZE, &list, &attributes(), Compression::Piz).unwrap();
    std::fs::write(file, bytes).unwrap();
}

#[test]
fn separate_processes_give_equal_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let files: Vec<_> = (0..2)
        .map(|n| {
            let file = dir.path().join(n.to_string());
            let status = std::process::Command::new(std::env::current_exe().unwrap())
                .args([
                    "--ignored",
                    "--exact",
                    "io::exr::encode::tests::layer_child",
                ])
                .env("VOXLATHE_TEST_OUT", &file)
                .output()
                .unwrap()
                .status;
            assert!(status.success());
            std::fs::read(file).unwrap()
        })
        .collect();
    assert!(!files[0].is_empty());
    assert_eq!(files[0], files[1]);
}

#[test]
fn bad_layers_are_refused_with_reasons() {
    let encode = |list: &[(&str, Samples<'_>)]| {
        encode_layer([2, 2], list, &Attributes::new(), Compression::Zip)
            .unwrap_err()
            .to_string()
    };
    let four = [0.0_f32; 4];
    assert_eq!(
        encode(&[]),
        "a layer needs at least one channel; name one, such as sdf"
    );
    assert_eq!(
        encode(&[("sdf", Samples::Float(&four[..3]))]),
        "channel \"sdf\" has 3 samples; a layer of 2 x 2 voxels needs 4"
    );
    assert_eq!(
        encode(&[
            ("sdf", Samples::Float(&four)),
            ("sdf", Samples::Float(&four))
        ]),
        "channel \"sdf\" appears twice; each channel needs its own name"
    );
    assert_eq!(
        encode(&[("a b", Samples::Float(&four))]),
        "channel name \"a b\" is not usable; use 1 to 255 printable ASCII characters without blanks"
    );
    let mut reserved = Attributes::new();
    reserved.insert("channels".into(), Attribute::Int(1));
    assert_eq!(
        encode_layer(
            [2, 2],
            &[("sdf", Samples::Float(&four))],
            &reserved,
            Compression::Zip
        )
        .unwrap_err()
        .to_string(),
        "header attribute \"channels\" is one of the format's own; rename or drop it"
    );
    assert_eq!(
        encode_layer(
            [0, 5],
            &[("sdf", Samples::Float(&[]))],
            &Attributes::new(),
            Compression::Zip
        ),
        Err(ExrError::Size {
            width: 0,
            height: 5
        })
    );
    assert!(
        encode_layer(
            [usize::MAX, 2],
            &[("sdf", Samples::Float(&four))],
            &Attributes::new(),
            Compression::Zip
        )
        .is_err()
    );
}

/// The layer by the `exr` crate's own writer of whole files, its header put in order.
fn by_the_crate(
    size: [usize; 2],
    channels: &[(&str, Samples<'_>)],
    attributes: &Attributes,
    compression: Compression,
) -> Vec<u8> {
    use ::exr::block::writer::ChunksWriter as _;

    let mut sorted = channels.to_vec();
    sorted.sort_by_key(|c| c.0);
    let compression = compression.resolve(channels.iter().map(|c| c.0)).to_exr();
    let header = header(size, &sorted, attributes, compression).unwrap();
    let [width, height] = size;
    let lines = compression.scan_lines_per_block().min(height);
    let mut bytes = Vec::new();
    ::exr::block::write(
        std::io::Cursor::new(&mut bytes),
        vec![header].into(),
        true,
        |meta, writer| {
            let mut compressor = writer.sequential_blocks_compressor(&meta);
            for (index, y) in (0..height).step_by(lines).enumerate() {
                let rows = lines.min(height - y);
                let mut data = Vec::new();
                for row in y..y + rows {
                    for (_, samples) in &sorted {
                        for n in row * width..(row + 1) * width {
                            match samples {
                                Samples::Half(s) => data.extend(f16::from(s[n]).to_ne_bytes()),
                                Samples::Float(s) => data.extend(s[n].to_ne_bytes()),
                                Samples::Uint(s) => data.extend(s[n].to_ne_bytes()),
                            }
                        }
                    }
                }
                let place = BlockIndex {
                    layer: 0,
                    pixel_position: Vec2(0, y),
                    pixel_size: Vec2(width, rows),
                    level: Vec2(0, 0),
                };
                compressor.compress_block(index, UncompressedBlock { index: place, data })?;
            }
            Ok(())
        },
    )
    .unwrap();
    sort_header(&mut bytes).unwrap();
    bytes
}

#[test]
fn bytes_are_those_of_the_crates_writer() {
    // Sizes on both sides of a band of lines, and used one after the other by one encoder.
    let mut encoder = LayerEncoder::default();
    for size in [[1, 1], [300, 211], [1, 67], [67, 1], [33, 17], [9000, 3]] {
        let layer = Layer::ball(size);
        let counts: Vec<u8> = (0..size[0] * size[1]).map(|n| (n % 251) as u8).collect();
        let mut all = layer.channels().to_vec();
        all.push(("counts", Samples::Half(&counts)));
        for compression in Compression::ALL {
            for list in [&all[..], &all[..1], &all[2..3]] {
                let wanted = by_the_crate(size, list, &attributes(), compression);
                let found = encoder.encode(size, list, &attributes(), compression);
                assert!(found.unwrap() == wanted, "{size:?}, {compression}");
                let mut next = 0;
                let watched = encoder
                    .encode_watched(size, list, &attributes(), compression, |rows| {
                        assert_eq!(rows.start, next);
                        next = rows.end;
                        Ok::<_, ExrError>(())
                    })
                    .unwrap();
                assert!(watched.bytes == wanted);
                assert_eq!(watched.blake3, blake3::hash(&wanted));
                assert_eq!(next, size[1]);
            }
        }
    }
}

#[test]
fn an_error_in_between_ends_the_layer_and_spoils_nothing() {
    let layer = Layer::ball([300, 211]);
    let list = layer.channels();
    let mut encoder = LayerEncoder::default();
    for compression in [Compression::None, Compression::Zip] {
        let error = encoder
            .encode_watched([300, 211], &list, &attributes(), compression, |rows| {
                if rows.end > 100 {
                    Err(ExrError::NoChannels)
                } else {
                    Ok(())
                }
            })
            .unwrap_err();
        assert_eq!(error, ExrError::NoChannels);
        let small = Layer::ball(SIZE);
        let list = small.channels();
        assert_eq!(
            encoder
                .encode(SIZE, &list, &attributes(), compression)
                .unwrap(),
            encode_layer(SIZE, &list, &attributes(), compression).unwrap()
        );
    }
}

/// The crate's reader of whole images goes another way than its reader of blocks.
#[test]
fn the_image_reader_agrees() {
    use ::exr::prelude::{FlatSamples, ReadChannels as _, ReadLayers as _};

    let size = [61, 45];
    let layer = Layer::ball(size);
    for compression in Compression::ALL {
        let bytes = encode_layer(size, &layer.channels(), &attributes(), compression);
        let image = ::exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(std::io::Cursor::new(bytes.unwrap()))
            .unwrap();
        assert_eq!(image.layer_data.size, Vec2(61, 45));
        let list = &image.layer_data.channel_data.list;
        assert_eq!(list.len(), 4);
        for channel in list {
            match (channel.name.to_string().as_str(), &channel.sample_data) {
                ("occupancy", FlatSamples::F16(found)) => {
                    assert!(
                        found.iter().eq(&layer
                            .occupancy
                            .iter()
                            .map(|&v| f16::from(v))
                            .collect::<Vec<_>>())
                    );
                }
                ("material", FlatSamples::U32(found)) => assert_eq!(found, &layer.material),
                ("fraction" | "sdf", FlatSamples::F32(found)) => {
                    let wanted = if channel.name.to_string() == "sdf" {
                        &layer.sdf
                    } else {
                        &layer.fraction
                    };
                    let lossy = compression == Compression::Pxr24;
                    assert!(lossy || found == wanted, "{compression}");
                }
                (name, samples) => panic!("{name}: {samples:?}"),
            }
        }
    }
}
