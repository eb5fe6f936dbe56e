//! The program in a folder of its own, and what it says.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::curve::resident_kib;
use crate::display::{Area, Display, Shot};
use crate::folder::Folder;

/// Pixels of the window when it opens.
pub const WINDOW: [usize; 2] = [512, 384];

/// The longest that anything may take.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// A ball beside a smaller one in a haze.
pub const SCENE: &str = r#"
[volume]
path = "balls_24x24x24_uint8.raw"
[medium]
density = 0.1
[[medium.transfer]]
value = 20
opacity = 0.0
[[medium.transfer]]
value = 110
opacity = 1.0
color = [0.9, 0.8, 0.7]
[[surfaces.iso]]
value = 150
color = [0.2, 0.5, 0.9]
[[light]]
type = "directional"
direction = [0.3, -1.0, -0.4]
irradiance = [3.0, 3.0, 3.0]
[[light]]
type = "environment"
radiance = [0.4, 0.4, 0.4]
[render]
variant = "caching"
cache_scale = 0.25
background = [0.0, 0.0, 0.0]
"#;

impl Folder {
    /// It holds `scene.toml` and its volume.
    pub fn new() -> Folder {
        let folder = Folder::empty();
        let voxel = |i: usize| {
            let at = [i % 24, i / 24 % 24, i / 576].map(|n| n as f64 - 11.5);
            let ball = |center: [f64; 3], slope: f64| {
                let squares = (0..3).map(|a| (at[a] - center[a]).powi(2));
                255.0 - slope * squares.sum::<f64>().sqrt()
            };
            ball([-3.0, 0.0, 0.0], 17.0)
                .max(ball([6.0, 3.0, 4.0], 34.0))
                .max(0.0) as u8
        };
        let voxels: Vec<u8> = (0..24 * 24 * 24).map(voxel).collect();
        folder.write("balls_24x24x24_uint8.raw", &voxels);
        folder.write_scene(str::to_string);
        folder
    }

    pub fn has(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    pub fn write_scene(&self, change: impl FnOnce(&str) -> String) {
        // In one step, as editors do it: the window must not read half of it.
        self.write("scene.toml~", change(SCENE).as_bytes());
        fs::rename(self.path("scene.toml~"), self.path("scene.toml")).expect("a file");
    }

    fn without_display(&self, arguments: &str) -> Command {
        let mut command = self.isolume(arguments);
        command
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .env_remove("DISPLAY");
        command
    }

    pub fn window(
        &self,
        display: &Display,
        arguments: &str,
        [width, height]: [usize; 2],
    ) -> Command {
        let mut command =
            self.without_display(&format!("view {arguments} --window {width}x{height}"));
        command.env("DISPLAY", &display.name);
        command
    }

    pub fn view(&self, display: &Display, arguments: &str) -> Program {
        Program::start(&mut self.window(display, arguments, WINDOW))
    }

    pub fn view_losing_device(&self, display: &Display, scene: &str, submission: u32) -> Program {
        let mut command = self.window(display, scene, WINDOW);
        Program::start(command.env("ISOLUME_LOSE_DEVICE", submission.to_string()))
    }

    pub fn view_failing_allocation(&self, display: &Display, scene: &str, n: usize) -> Program {
        let mut command = self.window(display, scene, WINDOW);
        Program::start(command.env("ISOLUME_FAIL_ALLOCATION", n.to_string()))
    }

    pub fn view_without_display(&self, scene: &str) -> Output {
        let mut command = self.without_display(&format!("view {scene}"));
        command.output().expect("the program starts")
    }

    /// `render` makes of `scene` what the window has shown in `area`.
    pub fn renders_like(&self, scene: &str, shown: &Shot, area: Area) {
        let arguments = format!("render {scene} --spp 6 -o again.png --quiet");
        let output = self
            .without_display(&arguments)
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{output:?}");
        let picture = image::open(self.path("again.png"))
            .expect("a PNG")
            .to_rgb8();
        let [columns, rows] = area;
        let inside = |from: usize, end: usize| from..(from + TILE).min(end);
        for top in rows.clone().step_by(TILE) {
            for left in columns.clone().step_by(TILE) {
                let tile = [inside(left, columns.end), inside(top, rows.end)];
                let a = mean(&tile, |x, y| shown.at(x, y));
                let b = mean(&tile, |x, y| picture.get_pixel(x as u32, y as u32).0);
                let apart = (a - b).abs();
                assert!(apart < 12.0, "{a} was shown, {b} rendered at {tile:?}");
            }
        }
    }
}

/// Pixels of a tile, over which noise averages out.
const TILE: usize = 16;

/// Over all pixels and channels of a tile, of 255.
fn mean([columns, rows]: &Area, pixel: impl Fn(usize, usize) -> [u8; 3]) -> f64 {
    let all = rows
        .clone()
        .flat_map(|y| columns.clone().map(move |x| (x, y)));
    let sum: f64 = all
        .map(|(x, y)| pixel(x, y).iter().map(|c| f64::from(*c)).sum::<f64>())
        .sum();
    sum / (3 * columns.len() * rows.len()) as f64
}

/// The program while it runs.
pub struct Program {
    child: Child,
    lines: Receiver<String>,
    said: Vec<String>,
}

impl Program {
    pub fn start(command: &mut Command) -> Program {
        let mut child = command
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let stderr = BufReader::new(child.stderr.take().expect("a pipe"));
        let (sender, lines) = channel();
        thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Program {
            child,
            lines,
            said: Vec::new(),
        }
    }

    /// Reads on until a line begins like this.
    #[track_caller]
    pub fn wait_for(&mut self, beginning: &str) {
        if !self.comes_to(beginning) {
            panic!("ended before \"{beginning}\": {:?}", self.said);
        }
    }

    /// The same; false if the program ends before.
    #[track_caller]
    pub fn comes_to(&mut self, beginning: &str) -> bool {
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            match self.lines.recv_timeout(left) {
                Ok(line) => {
                    assert!(!line.starts_with("Vulkan validation"), "{line}");
                    self.said.push(line);
                    if self.said.last().is_some_and(|l| l.starts_with(beginning)) {
                        return true;
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    panic!("waited for \"{beginning}\", but it said {:?}", self.said)
                }
                Err(RecvTimeoutError::Disconnected) => return false,
            }
        }
    }

    /// Stops it while something happens, so that one frame finds all of that.
    pub fn while_stopped(&self, what: impl FnOnce()) {
        let send = |signal| kill_process(Pid::from_child(&self.child), signal).expect("a process");
        send(Signal::STOP);
        what();
        send(Signal::CONT);
    }

    pub fn said(&self) -> &[String] {
        &self.said
    }

    pub fn has_said(&self, beginning: &str) -> bool {
        self.said.iter().any(|line| line.starts_with(beginning))
    }

    /// Once a picture is finished, there is nothing left to do.
    #[track_caller]
    pub fn is_idle(&self) {
        // A few frames follow, which take a slow machine a few seconds.
        let mut seconds = (0..6).map(|_| self.cpu_seconds_in(Duration::from_millis(1500)));
        let is_idle = seconds.any(|seconds| seconds <= 0.06);
        assert!(is_idle, "it never rests for 1.5 s");
    }

    /// CPU time that it takes within so long.
    pub fn cpu_seconds_in(&self, duration: Duration) -> f64 {
        let before = self.cpu_seconds();
        thread::sleep(duration);
        self.cpu_seconds() - before
    }

    /// CPU time of all its threads so far, to a hundredth of a second.
    pub fn cpu_seconds(&self) -> f64 {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.child.id())).expect("Linux");
        let fields: Vec<&str> = stat.split_whitespace().collect();
        let number = |i: usize| fields[i].parse::<f64>().expect("a number");
        (number(13) + number(14)) / 100.0
    }

    /// Memory that it has.
    pub fn resident_kib(&self) -> u64 {
        resident_kib(self.id()).unwrap_or_else(|| panic!("it has ended and said {:?}", self.said))
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits for the program's end. Whatever it says until then is read.
    pub fn ended(&mut self) -> ExitStatus {
        let until = Instant::now() + PATIENCE;
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                break status;
            }
            assert!(Instant::now() < until, "it does not end: {:?}", self.said);
            thread::sleep(Duration::from_millis(20));
        };
        self.said.extend(self.lines.iter());
        status
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
