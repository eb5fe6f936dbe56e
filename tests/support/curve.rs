//! What a process holds as time goes by: resident memory, memory of the device, open files. A soak records it, and fails if it
//! grows.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// Rows of a short soak; a long one has one a minute.
const ROWS: f64 = 40.0;
/// Resident memory may grow by so much from the second quarter of the time to the last: drivers and allocators keep some.
const GROWTH: f64 = 1.05;
const GROWTH_KIB: f64 = 8192.0;

#[derive(Debug, Clone, Copy)]
struct Row {
    minutes: f64,
    resident_kib: f64,
    device_bytes: f64,
    handles: f64,
    /// How often what is repeated has been done.
    done: u64,
}

pub struct Curve {
    name: &'static str,
    process: u32,
    began: Instant,
    lasts: Duration,
    rows: Vec<Row>,
    table: File,
}

impl Curve {
    /// Begins to watch a process for `ISOLUME_SOAK_MINUTES`, and a table of that, `soak_NAME.csv` in the build's folder for
    /// tests.
    pub fn begin(name: &'static str, process: u32) -> Curve {
        let minutes = std::env::var("ISOLUME_SOAK_MINUTES");
        let minutes: f64 = minutes.map_or(1.0, |m| {
            m.parse()
                .expect("ISOLUME_SOAK_MINUTES: a number of minutes")
        });
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("soak_{name}.csv"));
        println!("{name}: {minutes} minutes into {}", path.display());
        let mut table = File::create(path).expect("a table");
        writeln!(table, "minutes,resident_kib,device_bytes,handles,done").expect("a line");
        Curve {
            name,
            process,
            began: Instant::now(),
            lasts: Duration::from_secs_f64(60.0 * minutes),
            rows: Vec::new(),
            table,
        }
    }

    /// Takes down what the process holds, where it is time for that. Returns whether there is time for more.
    pub fn goes_on(&mut self, done: u64) -> bool {
        let elapsed = self.began.elapsed();
        let every = (self.lasts.as_secs_f64() / ROWS).min(60.0);
        if elapsed.as_secs_f64() >= every * (self.rows.len() + 1) as f64 {
            let row = Row {
                minutes: elapsed.as_secs_f64() / 60.0,
                resident_kib: resident_kib(self.process).expect("a process") as f64,
                device_bytes: device_bytes(self.process),
                handles: handles(self.process).count() as f64,
                done,
            };
            writeln!(
                self.table,
                "{:.2},{},{},{},{}",
                row.minutes, row.resident_kib, row.device_bytes, row.handles, row.done
            )
            .expect("a line");
            self.rows.push(row);
        }
        elapsed < self.lasts
    }

    /// Fails if the process held more in the last quarter of the time than in the second one. The first is for warming up.
    pub fn assert_level(&self) {
        let quarter = self.rows.len() / 4;
        assert!(quarter > 0, "{} rows", self.rows.len());
        let [before, after] = [quarter, self.rows.len() - quarter];
        let held = |of: fn(&Row) -> f64| {
            [before, after].map(|from| {
                let mut values: Vec<f64> = self.rows[from..from + quarter].iter().map(of).collect();
                values.sort_by(f64::total_cmp);
                values[quarter / 2]
            })
        };
        let [resident, device, handles] = [
            held(|row| row.resident_kib),
            held(|row| row.device_bytes),
            held(|row| row.handles),
        ];
        println!(
            "{}: {} times; from the second quarter to the last: resident KiB {resident:?}, device bytes {device:?}, \
             handles {handles:?}",
            self.name,
            self.rows.last().map_or(0, |row| row.done)
        );
        assert!(
            resident[1] <= GROWTH * resident[0] + GROWTH_KIB,
            "resident memory grows: {resident:?} KiB"
        );
        assert!(
            device[1] <= GROWTH * device[0],
            "the device's memory grows: {device:?} bytes"
        );
        assert!(
            handles[1] <= handles[0] + 2.0,
            "open files grow: {handles:?}"
        );
    }
}

/// Whether a soak runs under validation: unless the environment has `ISOLUME_VALIDATION=0`, to tell the program's memory from
/// that of the layers.
pub fn validates() -> bool {
    std::env::var_os("ISOLUME_VALIDATION").is_none_or(|value| value != "0")
}

/// Memory that a process has; none if it has ended.
pub fn resident_kib(process: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The names of what describes its open files.
fn handles(process: u32) -> impl Iterator<Item = std::path::PathBuf> {
    let folder = fs::read_dir(format!("/proc/{process}/fdinfo")).expect("a process");
    folder.flatten().map(|entry| entry.path())
}

/// Memory of the device, as kernel drivers tell it of each open file; a driver on the CPU has resident memory only.
fn device_bytes(process: u32) -> f64 {
    let kib = |line: &str| {
        let (_, value) = line.split_once("drm-resident-vram")?.1.split_once(':')?;
        value.split_whitespace().next()?.parse::<u64>().ok()
    };
    let of_file = |path: std::path::PathBuf| {
        let about = fs::read_to_string(path).unwrap_or_default();
        about.lines().filter_map(kib).sum::<u64>()
    };
    1024.0 * handles(process).map(of_file).sum::<u64>() as f64
}
