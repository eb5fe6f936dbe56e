//! The profile of a run in Chrome's trace-event format, which Perfetto and chrome://tracing load:
//! GPU passes on one track, CPU stages on another, memory as a counter. All times are microseconds
//! from the start of the run.

use serde::Serialize;

#[derive(Debug, Clone, Serialize)]
pub struct Trace {
    #[serde(rename = "traceEvents")]
    events: Vec<Event>,
    #[serde(rename = "displayTimeUnit")]
    unit: &'static str,
}

/// The format tells events apart by `ph`, their phase.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "ph")]
enum Event {
    #[serde(rename = "X")]
    Complete {
        name: String,
        cat: &'static str,
        pid: u32,
        tid: u32,
        ts: f64,
        dur: f64,
        #[serde(skip_serializing_if = "Option::is_none")]
        args: Option<Share>,
    },
    #[serde(rename = "C")]
    Counter {
        name: &'static str,
        pid: u32,
        ts: f64,
        args: Bytes,
    },
    #[serde(rename = "M")]
    Metadata {
        name: &'static str,
        pid: u32,
        tid: u32,
        args: Name,
    },
}

#[derive(Debug, Clone, Serialize)]
struct Bytes {
    bytes: u64,
}

#[derive(Debug, Clone, Serialize)]
struct Share {
    peak_share: f64,
}

#[derive(Debug, Clone, Serialize)]
struct Name {
    name: &'static str,
}

const PROCESS: u32 = 1;
const CPU_TRACK: u32 = 1;
const GPU_TRACK: u32 = 2;

impl Default for Trace {
    fn default() -> Self {
        let named = |what, tid, name| Event::Metadata {
            name: what,
            pid: PROCESS,
            tid,
            args: Name { name },
        };
        Trace {
            events: vec![
                named("process_name", CPU_TRACK, "isolume"),
                named("thread_name", CPU_TRACK, "CPU stages"),
                named("thread_name", GPU_TRACK, "GPU passes"),
            ],
            unit: "ms",
        }
    }
}

impl Trace {
    /// Adds a run of a pass, with its share of the device's peak where that is known.
    pub fn add_gpu(
        &mut self,
        name: impl Into<String>,
        start_us: f64,
        dur_us: f64,
        peak_share: Option<f64>,
    ) {
        self.events.push(Event::Complete {
            name: name.into(),
            cat: "gpu",
            pid: PROCESS,
            tid: GPU_TRACK,
            ts: start_us,
            dur: dur_us,
            args: peak_share.map(|peak_share| Share { peak_share }),
        });
    }

    pub fn add_cpu(&mut self, name: impl Into<String>, start_us: f64, dur_us: f64) {
        self.events.push(Event::Complete {
            name: name.into(),
            cat: "cpu",
            pid: PROCESS,
            tid: CPU_TRACK,
            ts: start_us,
            dur: dur_us,
            args: None,
        });
    }

    /// Adds the amount of device memory that is allocated from that moment on.
    pub fn add_memory(&mut self, at_us: f64, bytes: u64) {
        let args = Bytes { bytes };
        self.events.push(Event::Counter {
            name: "device memory",
            pid: PROCESS,
            ts: at_us,
            args,
        });
    }
}
