//! The command `view`: what its page holds, against other ways to the same numbers, and what it refuses.

#[path = "support/command.rs"]
mod support;

use std::fs;
use std::io::Read as _;
use std::os::unix::fs::PermissionsExt as _;

use serde_json::Value;
use support::{below, interruptible_command, names_in, run, scratch, shipped};

const SPHERE: &str = "schema = 1
name = 'ball'
units = 'mm'
grid = { resolution = 14 }
[[solid]]
kind = 'sphere'
radius = 2
place = [{ translate = [0.3, -7, 1e3] }]
";

/// A page taken apart: its model, and the bytes of each of its data.
struct Page {
    html: String,
    model: Value,
}

impl Page {
    fn read(path: &str) -> Self {
        let html = fs::read_to_string(path).expect("a page");
        let model = between(&html, "<script type=\"application/json\" id=\"model\">");
        let model = serde_json::from_str(model).expect("a model");
        Self { html, model }
    }

    fn channel(&self, name: &str) -> &Value {
        let all = self.model["channels"].as_array().expect("channels");
        let found = all.iter().find(|c| c["name"] == name);
        found.unwrap_or_else(|| panic!("no {name}"))
    }

    /// The samples of a channel, or of the surface, as their bits.
    fn bits(&self, head: &Value, dims: [usize; 3]) -> Vec<u32> {
        let id = head["data"].as_str().expect("an id");
        let digits = between(
            &self.html,
            &format!("<script type=\"text/plain\" id=\"{id}\">"),
        );
        let bytes = base64(digits);
        let layers = number(&head["layers"]);
        let is_float = head["kind"] == "float";
        let mut samples: Vec<u32> = Vec::new();
        let (mut at, mut first) = (0, 0);
        for length in head["slabs"].as_array().expect("slabs") {
            let count = layers.min(dims[2] - first);
            let mut slab = Vec::new();
            let end = at + number(length);
            flate2::bufread::DeflateDecoder::new(&bytes[at..end])
                .read_to_end(&mut slab)
                .expect("deflate");
            samples.extend(unpacked(&slab, is_float, [dims[0], dims[1], count]));
            (at, first) = (end, first + count);
        }
        assert_eq!((at, first), (bytes.len(), dims[2]));
        samples
    }
}

fn number(value: &Value) -> usize {
    usize::try_from(value.as_u64().expect("a number")).expect("a small one")
}

fn triple(value: &Value) -> [usize; 3] {
    [0, 1, 2].map(|a| number(&value[a]))
}

fn between<'a>(html: &'a str, start: &str) -> &'a str {
    let (_, rest) = html
        .split_once(start)
        .unwrap_or_else(|| panic!("no {start}"));
    rest.split_once("</script>").expect("an end").0
}

fn base64(digits: &str) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => panic!("{c} is no digit"),
    };
    let digits = digits.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::new();
    for group in digits.chunks(4) {
        let bits = group
            .iter()
            .fold(0_u32, |all, &c| all << 6 | u32::from(value(c)));
        let bits = bits << (6 * (4 - group.len()));
        bytes.extend(&bits.to_be_bytes()[1..group.len()]);
    }
    bytes
}

/// The samples of a slab, by the words of the codec's documentation.
fn unpacked(slab: &[u8], is_float: bool, [nx, ny, count]: [usize; 3]) -> Vec<u32> {
    let area = nx * ny;
    assert_eq!(slab.len(), count * (1 + 4 * area));
    let mut out = vec![0_u32; area * count];
    let order = |b: u32| if b >> 31 == 0 { b + (1 << 31) } else { !b };
    for n in 0..out.len() {
        let [i, j, k] = [n % nx, n / nx % ny, n / area];
        let flags = slab[k];
        let known = |di: usize, dj: usize, dk: usize| -> Option<u32> {
            (i >= di && j >= dj && k >= dk).then(|| out[n - di - dj * nx - dk * area])
        };
        let predicted = if flags & 4 != 0 && 2 * j > ny - 1 {
            out[k * area + (ny - 1 - j) * nx + i]
        } else if flags & 2 != 0 && 2 * i > nx - 1 {
            out[k * area + j * nx + nx - 1 - i]
        } else if is_float {
            let value = |b: Option<u32>| b.map(|b| f64::from(f32::from_bits(b)));
            let flat = |dk: usize| match [
                value(known(1, 0, dk)),
                value(known(0, 1, dk)),
                value(known(1, 1, dk)),
            ] {
                [Some(a), Some(b), Some(c)] => (a + b) - c,
                [Some(a), ..] => a,
                [_, Some(b), _] => b,
                _ => 0.0,
            };
            let mut guess = flat(0);
            if flags & 1 != 0 {
                guess += value(known(0, 0, 1)).expect("a layer before") - flat(1);
            }
            let guess = guess as f32;
            if guess.is_finite() {
                guess.to_bits()
            } else {
                0
            }
        } else {
            let flat = |dk: usize| match [known(1, 0, dk), known(0, 1, dk), known(1, 1, dk)] {
                [Some(a), Some(b), Some(c)] => a.wrapping_add(b).wrapping_sub(c),
                [Some(a), ..] => a,
                [_, Some(b), _] => b,
                _ => 0,
            };
            let mut guess = flat(0);
            if flags & 1 != 0 {
                guess = guess
                    .wrapping_add(known(0, 0, 1).expect("a layer before"))
                    .wrapping_sub(flat(1));
            }
            guess
        };
        let byte = |p: usize| u32::from(slab[count + p * area * count + n]);
        let lost = byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
        let difference = lost >> 1 ^ 0_u32.wrapping_sub(lost & 1);
        out[n] = if is_float {
            let place = order(predicted).wrapping_add(difference);
            if place >> 31 == 1 {
                place - (1 << 31)
            } else {
                !place
            }
        } else {
            predicted.wrapping_add(difference)
        };
    }
    out
}

/// The samples of `CHANNEL.raw`, as their bits.
fn raw(stack: &str, name: &str) -> Vec<u32> {
    let bytes = fs::read(format!("{stack}/{name}.raw")).expect("an array");
    if name == "occupancy" {
        return bytes.into_iter().map(u32::from).collect();
    }
    let four = bytes.chunks_exact(4);
    four.map(|b| u32::from_le_bytes(b.try_into().expect("four bytes")))
        .collect()
}

fn written(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = below(folder, name);
    fs::write(&path, text).expect("a scene");
    path
}

/// Every sample of a page is the stack's, bit for bit: of one body, of a composite with materials, of volumes with fields,
/// off the grid's symmetry, and of more channels than the scene names.
#[test]
fn samples_are_those_of_a_stack() {
    let folder = scratch();
    let ball = written(&folder, "ball.toml", SPHERE);
    let cases = [
        (
            ball,
            "15,11,9",
            "sdf,occupancy,fraction,normal-x,closest-z,curvature-mean",
        ),
        (shipped("goblet"), "40", ""),
        (
            shipped("assembly"),
            "22",
            "sdf,material,occupancy,fraction-2,face-y",
        ),
        (shipped("graded_block"), "9", ""),
    ];
    for (scene, resolution, channels) in cases {
        let (page, stack) = (below(&folder, "p.html"), below(&folder, "s"));
        let mut arguments = vec![
            "view",
            &scene,
            "-o",
            &page,
            "--force",
            "--json",
            "--resolution",
            resolution,
        ];
        if !channels.is_empty() {
            arguments.extend(["--channels", channels]);
        }
        let told = run(&arguments).exits(0).json();
        assert_eq!(told["warnings"], Value::Array(vec![]));
        let names: Vec<&str> = told["channels"]
            .as_array()
            .expect("names")
            .iter()
            .map(|n| n.as_str().expect("a name"))
            .collect();
        let list = names.join(",");
        run(&[
            "voxelize",
            &scene,
            "-o",
            &stack,
            "--force",
            "--formats",
            "raw",
            "--resolution",
            resolution,
            "--channels",
            &list,
        ])
        .exits(0);
        let page = Page::read(&page);
        let dims = triple(&told["dims"]);
        assert_eq!(page.model["grid"]["origin"], told["origin"]);
        for name in names {
            let mut wanted = raw(&stack, name);
            if name == "face-y" {
                let wide = dims[0] * (dims[1] + 1);
                let layers = wanted
                    .chunks(wide)
                    .flat_map(|layer| &layer[..dims[0] * dims[1]]);
                wanted = layers.copied().collect();
            }
            let head = page.channel(name);
            assert_eq!(head["exact_within"], Value::Null);
            assert!(page.bits(head, dims) == wanted, "{scene}: {name}");
        }
    }
}

/// A stack's page holds what its scene's page holds, from whichever of the formats that are read, and of all threads.
#[test]
fn a_stack_is_shown_without_its_scene() {
    let folder = scratch();
    let scene = written(&folder, "ball.toml", SPHERE);
    let own = below(&folder, "own.html");
    run(&["view", &scene, "-o", &own]).exits(0);
    let own = Page::read(&own);
    let dims = triple(&own.model["grid"]["dims"]);
    for formats in ["exr", "npy", "raw", "mhd", "vti,npy"] {
        let (stack, page) = (below(&folder, "stack"), below(&folder, "p.html"));
        run(&[
            "voxelize",
            &scene,
            "-o",
            &stack,
            "--formats",
            formats,
            "--force",
        ])
        .exits(0);
        let mut bytes = Vec::new();
        for threads in ["1", "3"] {
            let told = run(&[
                "view",
                &stack,
                "-o",
                &page,
                "--force",
                "--json",
                "--threads",
                threads,
            ])
            .exits(0)
            .json();
            assert_eq!(
                (&told["source"], &told["scene"]),
                (&"stack".into(), &"ball".into())
            );
            bytes.push(fs::read(&page).expect("a page"));
        }
        assert!(bytes[0] == bytes[1], "{formats}: threads show");
        let found = Page::read(&page);
        for name in ["occupancy", "fraction", "sdf"] {
            let same = found.bits(found.channel(name), dims) == own.bits(own.channel(name), dims);
            assert!(same, "{formats}: {name}");
        }
        // The box that is seen is that of the ball, 4 across, to a voxel.
        for a in 0..2 {
            let extent = found.model["view"]["extent"][a].as_f64().expect("a length");
            assert!((extent - 4.0).abs() < 0.7, "{extent}");
        }
        let manifest = fs::read(format!("{stack}/manifest.json")).expect("a manifest");
        let digest = blake3::hash(&manifest).to_hex();
        assert!(found.html.contains(digest.as_str()) && found.html.contains("digests verified"));
    }
    let (stack, page) = (below(&folder, "v"), below(&folder, "v.html"));
    run(&[
        "voxelize",
        &scene,
        "-o",
        &stack,
        "--formats",
        "vti,vdb",
        "--channels",
        "sdf",
    ])
    .exits(0);
    let refused = run(&["view", &stack, "-o", &page]).exits(2).err;
    assert!(
        refused.contains("it holds vti, vdb, and a page is made of exr, npy, raw, mhd"),
        "{refused}"
    );
    for more in [
        &["--set", "units='m'"][..],
        &["--resolution", "4"],
        &["--spacing", "1"],
    ] {
        let refused = run(&[&["view", &below(&folder, "stack"), "-o", &page][..], more].concat())
            .exits(2)
            .err;
        assert!(refused.contains("is a finished stack"), "{refused}");
    }
}

/// Without distances the surface is that of the shares; without those there is none, and the page says so.
#[test]
fn what_a_stack_lacks_is_said() {
    let folder = scratch();
    let scene = written(&folder, "ball.toml", SPHERE);
    let (stack, page) = (below(&folder, "s"), below(&folder, "p.html"));
    run(&["voxelize", &scene, "-o", &stack, "--channels", "fraction"]).exits(0);
    let told = run(&["view", &stack, "-o", &page, "--json"])
        .exits(0)
        .json();
    assert!(
        told["warnings"][0]
            .as_str()
            .expect("text")
            .contains("where fraction is a half")
    );
    assert_eq!(Page::read(&page).model["surface"]["distance"], false);
    let again = [
        "voxelize",
        &scene,
        "-o",
        &stack,
        "--force",
        "--channels",
        "normal-x",
    ];
    run(&again).exits(0);
    let told = run(&["view", &stack, "-o", &page, "--json", "--force"])
        .exits(0)
        .json();
    let said = told["warnings"].to_string();
    assert!(said.contains("no surface to draw"), "{said}");
    assert_eq!(Page::read(&page).model["surface"], Value::Null);
}

/// Of a grid above 512 voxels along a side every so manieth voxel is shown, with its own value.
#[test]
fn large_grids_are_reduced_with_a_notice() {
    let folder = scratch();
    let scene = written(&folder, "ball.toml", SPHERE);
    let (stack, page) = (below(&folder, "s"), below(&folder, "p.html"));
    let grid = [
        "--set",
        "grid={spacing=[0.004,0.6,0.8],origin=[-1.8,-9.3,997.9],dims=[1040,7,6]}",
    ];
    let told = run(&[&["view", &scene, "-o", &page, "--json"][..], &grid].concat())
        .exits(0)
        .json();
    run(&[
        &["voxelize", &scene, "-o", &stack, "--formats", "raw"][..],
        &grid,
    ]
    .concat())
    .exits(0);
    let said = told["warnings"][0].as_str().expect("a notice");
    assert!(
        said.starts_with("the grid of 1040 x 7 x 6 voxels is reduced to 347 x 2 x 2"),
        "{said}"
    );
    assert_eq!(
        (triple(&told["shown"]), number(&told["stride"])),
        ([347, 2, 2], 3)
    );
    let page = Page::read(&page);
    assert!(page.html.contains("is reduced to 347 x 2 x 2"));
    let first = triple(&page.model["shown"]["first"]);
    assert_eq!(first, [1, 1, 1]);
    let all = raw(&stack, "sdf");
    let found = page.bits(page.channel("sdf"), [347, 2, 2]);
    for (n, bits) in found.into_iter().enumerate() {
        let [i, j, k] = [n % 347, n / 347 % 2, n / 694].map(|v| 3 * v + 1);
        assert_eq!(bits, all[(k * 7 + j) * 1040 + i]);
    }
}

/// Names are text: nothing of a scene becomes markup, and no script runs but the page's own.
#[test]
fn markup_in_names_is_text() {
    let folder = scratch();
    let name = r#"</script><script>window.hacked=1</script><img src=x onerror="window.hacked=2">' & ÄÖ木 <!--"#;
    let scene = written(
        &folder,
        "odd.json",
        &serde_json::json!({
            "schema": 1,
            "name": name,
            "grid": { "resolution": 6 },
            "materials": { "1": name, "2": "\u{202e}turned" },
            "solid": [
                { "kind": "sphere", "radius": 1, "name": name, "material": 1 },
                { "kind": "box", "size": [1, 1, 3], "name": "<b>", "material": 2 },
            ],
        })
        .to_string(),
    );
    let page = below(&folder, "p.html");
    run(&["view", &scene, "-o", &page]).exits(0);
    let page = Page::read(&page);
    assert_eq!(page.model["name"], name);
    let html = &page.html;
    assert!(html.contains("<h1>&lt;/script&gt;&lt;script&gt;"));
    for found in ["<script>", "<img src=x", "<b>&", "\u{202e}<", "<!--"] {
        assert!(!html.contains(found), "{found}");
    }
    // One script runs, and it is marked; the policy lets no other run, and nothing be loaded.
    let nonce = html
        .split("<script nonce=\"")
        .nth(1)
        .expect("a script")
        .split('"')
        .next()
        .expect("a nonce");
    assert_eq!(html.matches("<script nonce=").count(), 1);
    assert!(html.contains(&format!("script-src 'nonce-{nonce}'")));
    assert!(html.contains("default-src 'none'") && !html.contains("unsafe"));
    let addresses: Vec<&str> = html
        .match_indices("http")
        .map(|(at, _)| &html[at..at + 22])
        .collect();
    assert!(
        addresses
            .iter()
            .all(|a| a.starts_with("http-equiv") || a.starts_with("http://www.w3.org/2000")),
        "{addresses:?}"
    );
    let report = below(&folder, "r.html");
    run(&["validate", &scene, "-o", &report]).exits(0);
    let report = fs::read_to_string(&report).expect("a report");
    assert!(report.contains("default-src 'none'") && !report.contains("<script"));
    assert!(report.contains("&lt;img src=x onerror=&quot;"));
}

#[test]
fn what_is_there_stays_without_force() {
    let folder = scratch();
    let scene = written(&folder, "ball.toml", SPHERE);
    let page = written(&folder, "p.html", "mine");
    let refused = run(&["view", &scene, "-o", &page]).exits(2).err;
    assert!(
        refused.contains("exists; choose another name, or give --force"),
        "{refused}"
    );
    assert_eq!(fs::read_to_string(&page).expect("a file"), "mine");
    run(&["view", &scene, "-o", &page, "--force"]).exits(0);
    assert!(
        fs::read_to_string(&page)
            .expect("a page")
            .ends_with("</html>\n")
    );
    assert_eq!(names_in(folder.path()), ["ball.toml", "p.html"]);
}

#[test]
fn what_cannot_be_is_refused_before_any_work() {
    let folder = scratch();
    let scene = written(&folder, "ball.toml", SPHERE);
    let page = below(&folder, "p.html");
    let says = |arguments: &[&str], code: i32, wanted: &str| {
        let failed = run(&[&["view"], arguments].concat()).exits(code).err;
        assert!(failed.contains(wanted), "{arguments:?}: {failed}");
        assert_eq!(
            names_in(folder.path()),
            ["ball.toml", "empty"],
            "{arguments:?}"
        );
    };
    let empty = below(&folder, "empty");
    fs::create_dir(&empty).expect("a directory");
    says(
        &[&scene, "-o", &below(&folder, "p.png")],
        2,
        "does not end in .html",
    );
    says(&[&scene], 2, "--output");
    says(
        &[&scene, "-o", &page, "--channels", "sfd"],
        2,
        "did you mean sdf?",
    );
    says(
        &[&scene, "-o", &page, "--channels", "sdf,sdf"],
        2,
        "is given twice",
    );
    says(
        &[&scene, "-o", &page, "--resolution", "0"],
        2,
        "--resolution",
    );
    says(
        &[&scene, "-o", &page, "--memory-limit", "1MiB"],
        2,
        "raise --memory-limit to",
    );
    says(
        &[&scene, "-o", &page, "--resolution", "2000000"],
        2,
        "raise --memory-limit to",
    );
    says(
        &[&scene, "-o", &page, "--set", "solid.0.radius=1e39"],
        2,
        "f32 distances need",
    );
    says(
        &[&scene, "-o", &page, "--set", "solid.0.radius=nan"],
        2,
        "radius",
    );
    says(
        &[&below(&folder, "none.toml"), "-o", &page],
        3,
        "cannot read",
    );
    says(&[&empty, "-o", &page], 3, "manifest.json");
    says(
        &[&scene, "-o", &below(&folder, "no/p.html")],
        3,
        "cannot write",
    );
    let failed = run(&["view", &scene, "-o", &page, "--json", "--channels", "x"])
        .exits(2)
        .json();
    assert_eq!(failed["error"]["exit_code"], 2);
}

/// A stack that is not what its manifest lists is not shown.
#[test]
fn a_damaged_stack_is_refused() {
    let folder = scratch();
    let scene = written(&folder, "ball.toml", SPHERE);
    let (stack, page) = (below(&folder, "s"), below(&folder, "p.html"));
    run(&["voxelize", &scene, "-o", &stack]).exits(0);
    let slice = format!("{stack}/slice-0007.exr");
    let whole = fs::read(&slice).expect("a slice");
    let mut changed = whole.clone();
    *changed.last_mut().expect("bytes") ^= 1;
    fs::write(&slice, changed).expect("written");
    let refused = run(&["view", &stack, "-o", &page]).exits(1).err;
    assert!(refused.contains("slice-0007.exr"), "{refused}");
    fs::remove_file(&slice).expect("removed");
    run(&["view", &stack, "-o", &page]).exits(1);
    fs::write(&slice, whole).expect("written");
    let manifest = format!("{stack}/manifest.json");
    let text = fs::read_to_string(&manifest).expect("a manifest");
    fs::write(&manifest, text.replace("\"ball\"", "\"bell\"")).expect("written");
    run(&["view", &stack, "-o", &page]).exits(1);
    assert_eq!(names_in(folder.path()), ["ball.toml", "s"]);
}

/// A run that is interrupted, or cannot write, leaves nothing.
#[test]
fn nothing_is_half_written() {
    let folder = scratch();
    let page = below(&folder, "p.html");
    let mut child = interruptible_command()
        .args([
            "view",
            &shipped("tea_bowl"),
            "-o",
            &page,
            "--resolution",
            "200",
            "--quiet",
        ])
        .spawn()
        .expect("a run");
    std::thread::sleep(std::time::Duration::from_millis(400));
    let pid = child.id().to_string();
    let killed = std::process::Command::new("kill")
        .args(["-INT", &pid])
        .status();
    assert!(killed.is_ok_and(|s| s.success()));
    assert_eq!(child.wait().expect("an end").code(), Some(130));
    assert!(names_in(folder.path()).is_empty());
    // As root every directory can be written.
    let closed = below(&folder, "closed");
    fs::create_dir(&closed).expect("a directory");
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).expect("closed");
    if fs::write(format!("{closed}/probe"), "").is_err() {
        run(&[
            "view",
            &shipped("torus"),
            "-o",
            &format!("{closed}/p.html"),
            "--resolution",
            "8",
        ])
        .exits(3);
    }
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o755)).expect("opened");
}

/// Nothing left of the solids: a page that says so.
#[test]
fn an_empty_scene_has_a_page() {
    let folder = scratch();
    let text = SPHERE.to_owned()
        + "[[solid]]\nkind = 'box'\nsize = [9, 9, 9]\nplace = [{ translate = [0, -7, 1e3] }]\noperation = 'subtract'\n";
    let scene = written(&folder, "none.toml", &text);
    let page = below(&folder, "p.html");
    let told = run(&["view", &scene, "-o", &page, "--json"])
        .exits(0)
        .json();
    assert!(
        told["warnings"].to_string().contains("nothing is left"),
        "{}",
        told["warnings"]
    );
    let page = Page::read(&page);
    assert!(page.html.contains("nothing is left of the solids"));
    let sdf = page.bits(page.channel("sdf"), triple(&told["dims"]));
    assert!(sdf.iter().all(|b| f32::from_bits(*b) > 0.0));
}

/// The page, and what the run says of it, in the help and among the completions.
#[test]
fn the_command_is_known() {
    assert!(run(&["--help"]).exits(0).out.contains("\n  view "));
    for kind in ["bash", "zsh", "fish", "powershell"] {
        assert!(
            run(&["generate", kind]).exits(0).out.contains("view"),
            "{kind}"
        );
    }
}
