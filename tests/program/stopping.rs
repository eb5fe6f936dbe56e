//! A render ends at the first of its limits, and says which; Ctrl-C is one of them.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::number::number;
use crate::{Folder, last_line};

#[test]
fn the_last_line_says_why_it_stopped() {
    let folder = Folder::new();
    for (limit, reason) in [
        ("--spp 5", "stopped because --spp 5 is reached"),
        ("--time 0.5", "s of rendering are over"),
        (
            "--error 0.5",
            "stopped because the relative error is below 0.5",
        ),
        ("--spp 1000000 --time 0.5", "s of rendering are over"),
        // Too short for the cache's first paths, which may be late.
        ("--variant caching --time 0.001", "s of rendering are over"),
        // Farther away than any clock counts.
        ("--spp 2 --time 1e19", "stopped because --spp 2 is reached"),
        (
            "--spp 8 --time 1e19 --variant caching",
            "stopped because --spp 8 is reached",
        ),
        (
            "--spp 3 --time 600 --error 1e-9",
            "stopped because --spp 3 is reached",
        ),
    ] {
        let output = folder.succeed(&format!("render ball.toml -o a.png {limit}"));
        let line = last_line(&output);
        assert!(
            line.starts_with("a.png: ") && line.contains(reason),
            "{line}"
        );
    }
}

#[test]
fn ctrl_c_writes_what_there_is() {
    let folder = Folder::new();
    // The first line of progress: samples are there, and the handler is.
    let rest = interrupted(
        &folder,
        "render ball.toml -o a.exr -o a.png --stats s.json --time 600",
        " spp, ",
    );
    assert!(rest.contains("stopped because of Ctrl-C"), "{rest}");
    assert!(number(&folder.json("s.json")["spp"]) > 0.0);
    assert_eq!(
        image::open(folder.path("a.png")).expect("a PNG").width(),
        24
    );
    assert!(folder.exr("a.exr").layer_data[0].channel_data.list.len() >= 13);
    assert!(folder.names().iter().all(|name| !name.starts_with('.')));
}

/// The signal comes within the first sample of a later picture; earlier ones are kept, and the same command renders the
/// rest.
#[cfg(unix)]
#[test]
fn ctrl_c_ends_an_orbit_with_what_is_done() {
    let folder = Folder::new();
    let orbit = "render ball.toml --variant non-caching --size 512x512 --spp 1 --orbit 24 -o turn.exr \
                 --checkpoint c.exr --stats s.json";
    let mut child = started(&folder, orbit);
    let first = folder.path("turn.0001.exr");
    wait_until(&mut child, "a first picture", || first.exists());
    send(Signal::INT, &child);
    let rest = ends(child, 130);
    let last = rest.lines().last().expect("a line");
    assert!(
        last.starts_with("turn.0001.exr") && last.contains("stopped because of Ctrl-C"),
        "{rest}"
    );
    assert!(!rest.contains("nothing"), "{rest}");
    let stats = folder.json("s.json");
    assert_eq!(stats["spp"], 1);
    let is_there = |number: &u32| folder.path(&format!("turn.{number:04}.exr")).exists();
    let pictures = (1..=24).filter(is_there).count();
    assert_eq!(stats["views"].as_array().map(Vec::len), Some(pictures));
    let missing = format!("before picture {} of 24", pictures + 1);
    assert!(last.contains(&missing), "{rest}");
    let output = folder.succeed(orbit);
    assert!((1..=24).all(|number| is_there(&number)));
    assert!(
        last_line(&output).contains("to turn.0024.exr: 1 samples"),
        "{output:?}"
    );
}

#[test]
fn ctrl_c_ends_a_bench_with_a_report() {
    let folder = Folder::new();
    folder.succeed("render ball.toml -o given.exr --spp 4");
    interrupted(
        &folder,
        "bench ball.toml -o report --reference given.exr --variants non-caching --seconds 0.1,600",
        " spp, ",
    );
    let report = folder.json("report/report.json");
    let points = &report["subjects"][0]["runs"][0]["points"];
    assert_eq!(points.as_array().map(Vec::len), Some(1), "{report:#}");
    folder.exr("report/non-caching.0.1s.exr");
}

/// Ends at the first batch of the cache: a sample of what it shows is taken, and written.
#[test]
fn sigterm_ends_a_render_as_ctrl_c_does() {
    let folder = Folder::new();
    let mut child = started(&folder, &format!("{CACHED} --size 256x256"));
    read_until(&mut child, "cache: ");
    send(Signal::TERM, &child);
    // A scheduler and the script that it stops may both send it.
    std::thread::sleep(Duration::from_millis(20));
    send(Signal::TERM, &child);
    let rest = ends(child, 143);
    assert!(rest.contains("stopped because of SIGTERM"), "{rest}");
    folder.exr("a.exr");
}

/// Opening a pipe waits for a reader. That must not outlast a scheduler's SIGTERM.
#[test]
fn sigterm_ends_a_render_into_a_pipe_that_nobody_reads() {
    let folder = Folder::new();
    let made = Command::new("mkfifo").arg(folder.path("a.exr")).status();
    assert!(made.expect("mkfifo").success());
    let mut child = started(&folder, "render ball.toml -o b.exr -o a.exr --spp 1");
    wait_until(&mut child, "b.exr", || {
        folder.names().iter().any(|name| name == "b.exr")
    });
    send(Signal::TERM, &child);
    let said = ends(child, 3);
    assert!(
        said.contains("a.exr: nobody reads from this pipe"),
        "{said}"
    );
}

/// As `timeout -s INT` sends it, to the program and to its group.
#[test]
fn ctrl_c_twice_at_once_is_one() {
    let folder = Folder::new();
    let mut child = started(&folder, &format!("{CACHED} --size 256x256"));
    read_until(&mut child, "cache: ");
    send(Signal::INT, &child);
    std::thread::sleep(Duration::from_millis(5));
    send(Signal::INT, &child);
    let rest = ends(child, 130);
    assert!(rest.contains("stopped because of Ctrl-C"), "{rest}");
    folder.exr("a.exr");
}

/// The sample that is taken all the same is all that was asked for, but the cache has not had its paths.
#[test]
fn a_filling_that_is_cut_is_interrupted_work() {
    let folder = Folder::new();
    let mut child = started(&folder, &format!("{CACHED} --size 256x256 --spp 1"));
    read_until(&mut child, "cache: ");
    send(Signal::INT, &child);
    let rest = ends(child, 130);
    assert!(rest.contains("stopped because of Ctrl-C"), "{rest}");
}

#[test]
fn a_second_ctrl_c_ends_without_writing() {
    let folder = Folder::new();
    let before = folder.names();
    let mut child = started(&folder, &format!("{CACHED} --size 1024x1024"));
    read_until(&mut child, "cache: ");
    // On a busy machine, two may be taken for one.
    while child.process.try_wait().expect("a process").is_none() {
        send(Signal::INT, &child);
        std::thread::sleep(Duration::from_millis(150));
    }
    let rest = ends(child, 130);
    assert!(
        rest.contains(
            "isolume: interrupted again before the outputs were written: nothing was written"
        ),
        "{rest}"
    );
    assert_eq!(folder.names(), before);
}

/// The handlers are there before anything is opened.
#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_while_loading_or_compiling_ends_at_once() {
    // As /proc has them: bit n − 1 is signal n.
    const BOTH: u64 = 1 << 1 | 1 << 14;
    let folder = Folder::new();
    let before = folder.names();
    for (command, signal, status) in [
        (CACHED, Signal::INT, 130),
        (CACHED, Signal::TERM, 143),
        ("doctor", Signal::INT, 130),
    ] {
        let mut child = started(&folder, command);
        let about = format!("/proc/{}/status", child.process.id());
        let catches_both = || {
            let about = std::fs::read_to_string(&about).expect("a process");
            let caught = about.lines().find_map(|l| l.strip_prefix("SigCgt:"));
            let caught = u64::from_str_radix(caught.expect("signals").trim(), 16);
            caught.expect("a mask") & BOTH == BOTH
        };
        wait_until(&mut child, "handlers", catches_both);
        send(signal, &child);
        let rest = ends(child, status);
        let expected = "isolume: interrupted: nothing was written\n";
        assert_eq!(rest, expected);
        assert_eq!(folder.names(), before);
    }
}

#[cfg(unix)]
#[test]
fn nohup_outlives_its_terminal() {
    let folder = Folder::new();
    let mut child = Child::new(&mut folder.shell("trap '' HUP;", CACHED));
    read_until(&mut child, "cache: ");
    send(Signal::HUP, &child);
    read_until(&mut child, "cache: ");
    send(Signal::TERM, &child);
    ends(child, 143);
}

/// Seen from within a white fog of optical depth 10⁷: no path gets out. What `--restart` ignores is left alone.
#[test]
fn the_time_holds_for_a_sample_without_end() {
    let folder = Folder::new();
    let fog = "--set medium.density=1e6 --set surfaces.iso=[] \
               --set medium.transfer.0.opacity=1 --set medium.transfer.0.color=[1,1,1] \
               --set medium.transfer.1.color=[1,1,1] --set camera.eye=[0,0,0] \
               --set camera.target=[0,0,-1]";
    let too_short = [
        ("non-caching", "render.max_bounces"),
        ("auto", "render.max_bounces"),
        ("caching", "--variant non-caching"),
    ];
    folder.write("c.exr", b"an older checkpoint");
    for (variant, remedy) in too_short {
        let command = format!(
            "render ball.toml -o a.exr {fog} --variant {variant} --time 0.5 --checkpoint c.exr --restart"
        );
        let output = folder.run(&command);
        let said = crate::text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{variant}: {said}");
        let after = said.split_once("--time 0.5: after ").expect("its time").1;
        let seconds = after.split(' ').next().expect("a number");
        let seconds: f64 = seconds.parse().expect("a number");
        assert!(seconds < 15.0, "{variant}: {said}");
        assert!(said.contains(remedy), "{variant}: {said}");
        assert!(!folder.path("a.exr").exists());
        assert_eq!(folder.read("c.exr"), b"an older checkpoint", "{variant}");
    }
}

/// A render without end that fills a cache first.
const CACHED: &str = "render ball.toml -o a.exr --variant caching --error 1e-9";

/// Nothing takes this long on any machine.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// A program under way, and what it says.
pub struct Child {
    pub process: std::process::Child,
    said: BufReader<std::process::ChildStderr>,
}

impl Child {
    fn new(command: &mut Command) -> Child {
        let mut process = command.stderr(Stdio::piped()).spawn().expect("it starts");
        let said = BufReader::new(process.stderr.take().expect("a pipe"));
        Child { process, said }
    }
}

/// A test that fails leaves nothing that renders on.
impl Drop for Child {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Waits until something is there that a program under way does.
pub fn wait_until(child: &mut Child, what: &str, is_there: impl Fn() -> bool) {
    let began = Instant::now();
    while !is_there() {
        let ended = child.process.try_wait().expect("a process");
        assert!(ended.is_none(), "it ended before {what}: {ended:?}");
        assert!(began.elapsed() < PATIENCE, "no {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

pub fn started(folder: &Folder, arguments: &str) -> Child {
    Child::new(&mut folder.isolume(arguments))
}

pub fn read_until(child: &mut Child, sign: &str) {
    let mut line = String::new();
    while !line.contains(sign) {
        line.clear();
        let read = child.said.read_line(&mut line).expect("a line");
        assert!(read > 0, "it ended by itself");
    }
}

pub fn send(signal: Signal, child: &Child) {
    send_to(signal, &child.process);
}

/// The same, to a process of which nothing is read.
pub fn send_to(signal: Signal, process: &std::process::Child) {
    kill_process(Pid::from_child(process), signal).expect("a process");
}

/// What it says until it ends, which is with `status`.
pub fn ends(mut child: Child, status: i32) -> String {
    let mut rest = String::new();
    child.said.read_to_string(&mut rest).expect("the rest");
    let ended = child.process.wait().expect("an end");
    assert_eq!(ended.code(), Some(status), "{rest}");
    rest
}

/// Runs what has no end until it says `sign`, presses Ctrl-C, and returns what it says then.
fn interrupted(folder: &Folder, arguments: &str, sign: &str) -> String {
    let mut child = started(folder, arguments);
    read_until(&mut child, sign);
    send(Signal::INT, &child);
    ends(child, 130)
}
