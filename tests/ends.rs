//! Runs that do not come to their end: killed, told to end, or refused by the system.
//!
//! `VOXLATHE_MOMENTS` sets at how many random moments each command is stopped; `VOXLATHE_SEED` which. `VOXLATHE_FLIPS` sets
//! how many bits of each file of a stack with previews are flipped.

#![cfg(unix)]

#[path = "support/command.rs"]
mod support;

use std::fs;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use glam::DVec3;
use rustix::process::{Pid, Signal, kill_process};
use support::{below, interruptible_command, names_in, run, scratch, shipped, write_npy};
use voxlathe::grid::{Channel, GridSpec};
use voxlathe::io::exr::Samples;
use voxlathe::io::stack::{ChannelSpec, StackOptions, StackSummary};
use voxlathe::io::{Manifest, StackWriter, verify_stack};

fn number(name: &str, default: u64) -> u64 {
    let text = std::env::var(name).unwrap_or_default();
    text.parse().unwrap_or(default)
}

/// A stream of numbers in [0, 1): Knuth's multiplier.
struct Random(u64);

impl Random {
    fn new(salt: u64) -> Self {
        Self(number("VOXLATHE_SEED", 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ salt)
    }

    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Starts the command with its temporary files in `place`.
fn start(place: &Path, arguments: &[String]) -> Child {
    interruptible_command()
        .args(arguments)
        .env("TMPDIR", place)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the command starts")
}

fn send(child: &Child, signal: Signal) {
    let pid = Pid::from_raw(i32::try_from(child.id()).expect("a small id")).expect("an id");
    // A process that has just ended cannot be told any more.
    let _ = kill_process(pid, signal);
}

/// Waits until the child is the command itself and asks to be told of signals: before, whatever has been started for it
/// is killed, and there is nothing to clean up. Where the system does not tell, a moment.
fn listens(child: &mut Child, signal: Signal) {
    let status = format!("/proc/{}/status", child.id());
    let begin = Instant::now();
    while child.try_wait().expect("a child to wait for").is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let caught = text.lines().find_map(|l| l.strip_prefix("SigCgt:"));
        let caught = caught.and_then(|c| u64::from_str_radix(c.trim(), 16).ok());
        let bit = 1 << (signal.as_raw() - 1);
        let late = begin.elapsed() > Duration::from_secs(10);
        if caught.is_none() || caught.is_some_and(|c| c & bit != 0) || late {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Waits for the end, at most so long.
fn ended_within(child: &mut Child, limit: Duration) -> Option<ExitStatus> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("a child to wait for") {
            return Some(status);
        }
        if start.elapsed() > limit {
            child.kill().expect("the child is ended");
            child.wait().expect("the child has ended");
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Everything below `path` that is not for people to see.
fn hidden(path: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for name in names_in(path) {
        let at = path.join(&name);
        if name.contains("voxlathe") {
            found.push(at.clone());
        }
        if at.is_dir() {
            found.extend(hidden(&at));
        }
    }
    found
}

/// Commands that write, as typed, each with its outputs in `place`.
fn writers(place: &Path) -> Vec<Vec<String>> {
    let points: Vec<[f64; 3]> = (0..3000)
        .map(|n| [f64::from(n % 17), f64::from(n % 13), f64::from(n % 7)])
        .collect();
    write_npy(&place.join("points.npy"), &points);
    let at = |name: &str| place.join(name).display().to_string();
    let (points, torus) = (at("points.npy"), shipped("torus"));
    let net = shipped("volume_torus");
    let (stack, study, table) = (at("made/deep/stack"), at("study"), at("table.csv"));
    let (mesh, page) = (at("m.ply"), at("page.html"));
    let (picture, volume) = (at("p.png"), at("v.g2"));
    let (mixed, single, tree) = (at("mixed"), at("one.vti"), at("one.zarr"));
    let shown = at("shown.html");
    let lists: [&[&str]; 13] = [
        &["voxelize", &torus, "-o", &stack, "--resolution", "24"],
        &[
            "voxelize",
            &torus,
            "-o",
            &stack,
            "--resolution",
            "20",
            "--force",
        ],
        &[
            "voxelize",
            &torus,
            "-o",
            &mixed,
            "--resolution",
            "16",
            "--formats",
            "zarr,npy,vti,nrrd,vdb,h5",
            "--force",
        ],
        &[
            "voxelize",
            &torus,
            "-o",
            &single,
            "--resolution",
            "16",
            "--force",
        ],
        &[
            "voxelize",
            &torus,
            "-o",
            &tree,
            "--resolution",
            "16",
            "--zarr-codec",
            "zstd",
            "--force",
        ],
        &[
            "view",
            &torus,
            "-o",
            &shown,
            "--resolution",
            "16",
            "--force",
        ],
        &["query", &torus, "--points", &points, "-o", &table],
        &["mesh", &torus, "-o", &mesh],
        &[
            "render", &torus, "-o", &picture, "--width", "160", "--height", "120",
        ],
        &["export", &net, "-o", &volume],
        &["validate", &torus, "--resolution", "12", "-o", &page],
        &["converge", &torus, "--resolutions", "8,12", "-o", &study],
        &["bench", &torus, "--resolution", "8", "--stages", "write"],
    ];
    let own = |list: &[&str]| {
        let list = list.iter().chain(&["--threads", "1", "--quiet"]);
        list.map(|a| (*a).to_owned()).collect()
    };
    lists.into_iter().map(own).collect()
}

/// Whether a run that is refused as there is something already has come to its end before it was stopped.
fn is_complete(arguments: &[String]) -> bool {
    let out = &arguments[arguments.iter().position(|a| a == "-o").expect("an output") + 1];
    match arguments[0].as_str() {
        "voxelize" => verify_stack(out).is_ok_and(|report| report.is_intact()),
        _ => names_in(out) == ["converge.csv", "converge.html", "converge.png"],
    }
}

/// Whether a stack, or one output without a manifest, is there as it was written.
fn is_whole(out: &str) -> bool {
    if out.ends_with(".vti") {
        return fs::read(out).is_ok_and(|bytes| bytes.ends_with(b"</VTKFile>\n"));
    }
    if out.ends_with(".html") {
        return fs::read(out).is_ok_and(|bytes| bytes.ends_with(b"</html>\n"));
    }
    if out.ends_with(".zarr") {
        let arrays = ["fraction", "occupancy", "sdf", "x", "y", "z", "zarr.json"];
        return names_in(out) == arrays
            && names_in(format!("{out}/sdf")) == ["c.0.0.0", "zarr.json"];
    }
    verify_stack(out).is_ok_and(|report| report.is_intact())
}

/// Stops each command that writes at random moments; the same command works again, and nothing dead remains.
fn stopped_at_random_moments(signal: Signal, salt: u64) {
    let t = scratch();
    let place = t.path();
    let mut random = Random::new(salt);
    for arguments in writers(place) {
        let forced = arguments.iter().any(|a| a == "--force");
        let clean = || {
            if !forced {
                let _ = fs::remove_dir_all(place.join("made"));
                let _ = fs::remove_dir_all(place.join("study"));
            }
        };
        clean();
        let begin = Instant::now();
        let mut whole = start(place, &arguments);
        let status = whole.wait().expect("the child ends");
        assert!(status.success(), "{arguments:?}: {status}");
        let took = begin.elapsed();
        for _ in 0..number("VOXLATHE_MOMENTS", 6) {
            clean();
            let moment = took.mul_f64(random.next() * 1.1);
            let mut child = start(place, &arguments);
            std::thread::sleep(moment);
            send(&child, signal);
            let status = ended_within(&mut child, Duration::from_secs(5));
            let status = status.unwrap_or_else(|| panic!("{arguments:?} did not end"));
            let told = status.code() == Some(143);
            assert!(
                told || status.success() || status.signal() == Some(signal.as_raw()),
                "{arguments:?} at {moment:?}: {status}"
            );
            if told {
                // It was asked, and had the time to clean up.
                assert_eq!(hidden(place), Vec::<PathBuf>::new(), "{arguments:?}");
            }
            if forced {
                assert!(is_whole(&arguments[3]), "{arguments:?} at {moment:?}");
            }
            let again = start(place, &arguments).wait().expect("the child ends");
            let refused = again.code() == Some(2) && !forced && is_complete(&arguments);
            assert!(
                again.success() || refused,
                "{arguments:?} at {moment:?}, then {again}"
            );
            assert_eq!(hidden(place), Vec::<PathBuf>::new(), "{arguments:?}");
        }
    }
}

#[test]
fn killed_commands_run_again_and_leave_nothing() {
    stopped_at_random_moments(Signal::KILL, 7);
}

#[test]
fn commands_that_are_told_to_end_leave_nothing() {
    stopped_at_random_moments(Signal::TERM, 8);
}

/// Commands that take long, each at a work of its own.
fn long_runs(place: &Path) -> Vec<Vec<String>> {
    let points: Vec<[f64; 3]> = (0..1_500_000)
        .map(|n| [f64::from(n % 1709), f64::from(n % 1301), f64::from(n % 70)])
        .collect();
    write_npy(&place.join("many.npy"), &points);
    // Slanted tori that meet: measuring, preparing and meshing take their time.
    let mut text = String::from("schema = 1\n");
    for n in 0..8 {
        let degrees = 11 * n;
        text += &format!(
            "[[solid]]\nkind = 'torus'\nmajor = 3\nminor = 1\n\
             place = [{{ rotate = {{ axis = [1, 0.3, 0], degrees = {degrees} }} }}]\n"
        );
    }
    let scene = place.join("tori.toml");
    fs::write(&scene, text).expect("a scene");
    let at = |name: &str| place.join(name).display().to_string();
    let (tori, goblet) = (at("tori.toml"), shipped("goblet"));
    let (stack, mesh, picture) = (at("s/stack"), at("m.ply"), at("p.png"));
    let (many, table, page) = (at("many.npy"), at("t.npy"), at("page.html"));
    let (study, shown, cut) = (at("study"), at("shown.html"), "z=0.1");
    let lists: [&[&str]; 11] = [
        &["voxelize", &goblet, "-o", &stack, "--resolution", "1500"],
        &[
            "voxelize",
            &tori,
            "-o",
            &stack,
            "--resolution",
            "300",
            "--channels",
            "fraction",
        ],
        &["view", &goblet, "-o", &shown, "--resolution", "512"],
        &["view", &tori, "-o", &shown, "--resolution", "100"],
        &["measure", &tori],
        &["mesh", &goblet, "-o", &mesh, "--chord-error", "5e-5"],
        &["validate", &goblet, "--resolution", "700", "-o", &page],
        &[
            "converge",
            &goblet,
            "--resolutions",
            "600,900",
            "-o",
            &study,
        ],
        &["query", &tori, "--points", &many, "-o", &table],
        &[
            "render", &tori, "-o", &picture, "--width", "8000", "--slice", cut,
        ],
        &["bench", &goblet, "--resolution", "500"],
    ];
    let own = |list: &[&str]| {
        let list = list.iter().chain(&["--quiet"]);
        list.map(|a| (*a).to_owned()).collect()
    };
    lists.into_iter().map(own).collect()
}

#[test]
fn every_command_ends_within_a_second_of_a_signal() {
    let t = scratch();
    let mut random = Random::new(9);
    let runs = long_runs(t.path());
    // A scene that never comes is waited for as well.
    let waiting = ["export", "-", "-o", "never.g2"]
        .map(str::to_owned)
        .to_vec();
    for arguments in runs.iter().chain([&waiting]) {
        for round in 0..number("VOXLATHE_MOMENTS", 6).div_ceil(3) {
            let signals = [Signal::TERM, Signal::INT, Signal::HUP, Signal::XCPU];
            let signal = signals[usize::try_from(round).expect("a small number") % 4];
            let mut child = interruptible_command()
                .args(arguments)
                .env("TMPDIR", t.path())
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("the command starts");
            listens(&mut child, signal);
            std::thread::sleep(Duration::from_secs_f64(1.2 * random.next()));
            let early = child.try_wait().expect("a child to wait for");
            let sent = Instant::now();
            send(&child, signal);
            let status = ended_within(&mut child, Duration::from_secs(20));
            let took = sent.elapsed();
            let status = status.unwrap_or_else(|| panic!("{arguments:?}: {signal:?} is ignored"));
            let code = if signal == Signal::INT { 130 } else { 143 };
            // One that was done in this moment may say so.
            let done = status.success() && took < Duration::from_millis(300);
            assert!(
                early.is_some() || done || status.code() == Some(code),
                "{arguments:?}: {signal:?}: {status}"
            );
            // The machine may be busy with other tests.
            assert!(
                took < Duration::from_millis(1000) || number("VOXLATHE_MOMENTS", 0) == 0,
                "{arguments:?}: {signal:?} took {took:?}"
            );
            assert!(took < Duration::from_secs(4), "{arguments:?}: {took:?}");
            assert_eq!(hidden(t.path()), Vec::<PathBuf>::new(), "{arguments:?}");
            assert!(!t.path().join("s").exists(), "{arguments:?}");
        }
    }
}

/// As `nohup` and background jobs of a shell have it.
#[test]
fn signals_that_the_caller_ignores_are_ignored() {
    let t = scratch();
    let out = below(&t, "out");
    let line = format!(
        "trap '' HUP INT; exec {} voxelize {} -o {out} --resolution 150 --quiet",
        env!("CARGO_BIN_EXE_voxlathe"),
        shipped("torus")
    );
    let mut child = Command::new("sh")
        .args(["-c", &line])
        .spawn()
        .expect("a shell");
    let start = Instant::now();
    while names_in(&out).is_empty() && start.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(2));
    }
    for signal in [Signal::HUP, Signal::INT] {
        send(&child, signal);
    }
    let status = child.wait().expect("the child ends");
    assert_eq!(status.code(), Some(0));
    run(&["info", &out]).exits(0);
}

#[test]
fn a_run_beyond_its_processor_time_cleans_up() {
    let t = scratch();
    let line = format!(
        "ulimit -S -t 1; exec {} voxelize {} -o {} --resolution 2000 --quiet",
        env!("CARGO_BIN_EXE_voxlathe"),
        shipped("goblet"),
        below(&t, "deep/out")
    );
    let mut child = Command::new("sh")
        .args(["-c", &line])
        .process_group(0)
        .stderr(Stdio::null())
        .spawn()
        .expect("a shell");
    let status = ended_within(&mut child, Duration::from_secs(60)).expect("it ends");
    assert_eq!(status.code(), Some(143));
    assert!(names_in(t.path()).is_empty());
}

/// Two runs into one directory: one has it, and the other is told so; nothing of the first is swept.
#[test]
fn a_directory_belongs_to_one_run_at_a_time() {
    let t = scratch();
    let out = below(&t, "out");
    let arguments = |n: &str| {
        let list = [
            "voxelize",
            &shipped("goblet"),
            "-o",
            &out,
            "--resolution",
            n,
            "--quiet",
        ];
        list.map(str::to_owned).to_vec()
    };
    let mut first = start(t.path(), &arguments("260"));
    let begin = Instant::now();
    while names_in(&out).is_empty() && begin.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(1));
    }
    for force in [&[][..], &["--force"]] {
        let own = arguments("5");
        let own = own.iter().map(String::as_str).chain(force.iter().copied());
        let done = run(&own.collect::<Vec<_>>());
        if first.try_wait().expect("a child to wait for").is_none() {
            assert_eq!(done.code, 2);
            assert!(done.err.contains("another run"), "{}", done.err);
        }
    }
    assert!(first.wait().expect("the child ends").success());
    run(&["info", &out]).exits(0);
}

/// A reader sees the old stack or the new one while they change places again and again.
#[test]
fn readers_see_the_old_stack_or_the_new_one() {
    for foreign in [false, true] {
        let t = scratch();
        let out = below(&t, "out");
        let torus = shipped("torus");
        run(&["voxelize", &torus, "-o", &out, "--resolution", "9"]).exits(0);
        if foreign {
            fs::write(format!("{out}/mine"), "mine").expect("a file");
        }
        std::thread::scope(|scope| {
            let writer = scope.spawn(|| {
                for n in 0..12 {
                    let size = ["5", "9"][n % 2];
                    let arguments = [
                        "voxelize",
                        &torus,
                        "-o",
                        &out,
                        "--resolution",
                        size,
                        "--force",
                    ];
                    run(&arguments).exits(0);
                }
            });
            let mut looks = 0;
            while !writer.is_finished() {
                let done = run(&["info", &out]);
                assert_eq!(done.code, 0, "{}\n{}", done.out, done.err);
                looks += 1;
            }
            assert!(looks > 0);
        });
    }
}

#[test]
fn an_edited_file_is_refused_before_any_work() {
    let t = scratch();
    let out = below(&t, "out");
    let torus = shipped("torus");
    let again = [
        "voxelize",
        &torus,
        "-o",
        &out,
        "--resolution",
        "6",
        "--force",
    ];
    run(&again).exits(0);
    // In the samples; in the manifest's digest, the key of it, and before.
    let places = [
        ("slice-0003.exr", 80),
        ("manifest.json", 30),
        ("manifest.json", 80),
        ("manifest.json", 900),
    ];
    for (name, from_end) in places {
        let path = t.path().join("out").join(name);
        let good = fs::read(&path).expect("a file");
        let mut edited = good.clone();
        let at = edited.len() - from_end;
        edited[at] ^= 1;
        fs::write(&path, &edited).expect("written");
        let before = names_in(&out);
        let done = run(&again).exits(2);
        assert!(done.err.contains(name), "{}", done.err);
        assert_eq!(fs::read(&path).expect("a file"), edited);
        assert_eq!(names_in(&out), before);
        fs::write(&path, &good).expect("written");
    }
    run(&again).exits(0);
}

/// Flips bits of a file of a stack, one at a time, each so many after the one before; how many. Every one must be found.
fn flip(out: &Path, name: &str, apart: usize) -> usize {
    let path = out.join(name);
    let good = fs::read(&path).expect("a file");
    let bits = (0..8 * good.len()).step_by(apart.max(1));
    let flipped = bits.map(|bit| {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        fs::write(&path, bytes).expect("written");
        let found = verify_stack(out);
        assert!(!found.is_ok_and(|r| r.is_intact()), "{name}, bit {bit}");
    });
    let flipped = flipped.count();
    fs::write(&path, good).expect("written");
    flipped
}

/// Every bit of every byte of a small stack: two layers with all channels, and two small pictures in the previews' place.
#[test]
fn every_flipped_bit_of_a_small_stack_is_found() {
    let t = scratch();
    let (out, picture) = (t.path().join("out"), below(&t, "p.png"));
    let size = ["--width", "16", "--height", "16"];
    let arguments = ["render", &shipped("torus"), "-o", &picture];
    run(&[&arguments[..], &size].concat()).exits(0);
    let picture = fs::read(picture).expect("a picture");
    let grid = GridSpec::new([3, 2, 2], DVec3::splat(-0.5), DVec3::splat(0.5)).expect("a grid");
    let known = [
        Channel::Occupancy,
        Channel::Fraction,
        Channel::Sdf,
        Channel::Material,
    ];
    let channels = known.map(|channel| ChannelSpec::of(channel, "m"));
    let writer = StackWriter::create(&out, &grid, channels.to_vec(), StackOptions::default());
    let writer = writer.expect("a stack");
    for k in 0..2 {
        let layer = [
            ("occupancy", Samples::Half(&[1, 0, 0, 1, 0, 0])),
            (
                "fraction",
                Samples::Float(&[0.75, 0.25, 0.0, 1.0, 0.0, 0.0]),
            ),
            ("sdf", Samples::Float(&[-0.1, 0.1, 0.5, -0.2, 0.2, 1.5])),
            ("material", Samples::Uint(&[1, 0, 0, 2, 0, 0])),
        ];
        writer.write_layer(k, &layer).expect("a layer");
    }
    for name in ["preview.png", "preview-slices.png"] {
        writer.write_other(name, &picture).expect("a picture");
    }
    writer.finish(StackSummary::default()).expect("a stack");
    let report = verify_stack(&out).expect("a stack");
    assert!(report.is_intact(), "{report:?}");
    let flipped: usize = (names_in(&out).iter())
        .map(|name| flip(&out, name, 1))
        .sum();
    eprintln!("{flipped} flipped bits are found");
    assert!(verify_stack(&out).expect("a stack").is_intact());
}

/// Bytes of every file of a stack with the previews that the command draws.
#[test]
fn a_flipped_bit_anywhere_in_a_stack_is_found() {
    let t = scratch();
    let out = below(&t, "out");
    let arguments = [
        "voxelize",
        &shipped("torus"),
        "-o",
        &out,
        "--resolution",
        "4",
        "--preview",
    ];
    run(&arguments).exits(0);
    let flips = number("VOXLATHE_FLIPS", 150).max(1);
    for name in names_in(&out) {
        let at = t.path().join("out");
        let bits = 8 * fs::metadata(at.join(&name)).expect("a file").len();
        let apart = usize::try_from(bits.div_ceil(flips)).expect("a small file");
        flip(&at, &name, apart);
    }
    run(&["info", &out]).exits(0);
}

#[test]
fn the_text_of_info_commands_no_terminal() {
    let t = scratch();
    let out = below(&t, "out");
    run(&[
        "voxelize",
        &shipped("torus"),
        "-o",
        &out,
        "--resolution",
        "3",
    ])
    .exits(0);
    let name = "\u{1b}[2J\u{1b}[31mevil\u{7}\u{9b}1m\u{202e}\r\u{0}";
    let mut manifest = Manifest::load(&out).expect("a manifest");
    manifest.scene_name = Some(name.into());
    manifest.units = "\u{1b}]0;title\u{7}".into();
    manifest.channels[0].meaning = name.into();
    manifest.materials = serde_json::json!({ "1": name });
    let bytes = manifest.to_bytes().expect("a manifest");
    fs::write(format!("{out}/manifest.json"), bytes).expect("written");
    fs::write(format!("{out}/\u{1b}[31m"), "").expect("written");
    let told = run(&["info", &out]).exits(1);
    assert!(
        told.out.contains("evil") && told.out.contains("\\u{1b}[31m"),
        "{}",
        told.out
    );
    // A manifest that nobody wrote is refused, and quoted no worse.
    let text = "{\"format\":\"voxlathe-stack\",\"schema\":1,\"\\u001b[31m\":1}";
    fs::write(format!("{out}/manifest.json"), text).expect("written");
    let refused = run(&["info", &out]).exits(1);
    for text in [told.out, told.err, refused.err] {
        let obeyed = |c: char| c != '\n' && (c.is_control() || c == '\u{202e}');
        assert!(!text.contains(obeyed), "{text:?}");
    }
}
