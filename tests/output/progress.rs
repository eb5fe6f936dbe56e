//! What is left to do, and how a log is told.

use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use isolume::output::progress::{Goal, Progress};

#[test]
fn the_goal_that_comes_first_decides_what_remains() {
    let spp = Goal {
        spp: Some(100),
        ..Goal::default()
    };
    assert_eq!(spp.remaining(25, 10.0, f64::NAN), Some(30.0));
    let error = Goal {
        relative_error: Some(0.02),
        ..Goal::default()
    };
    // Half the error takes four times as long.
    assert_eq!(error.remaining(1, 10.0, 0.04), Some(30.0));
    assert_eq!(error.remaining(1, 10.0, 0.01), Some(0.0));
    assert_eq!(error.remaining(1, 10.0, f64::INFINITY), None);
    let both = Goal {
        seconds: Some(35.0),
        ..error
    };
    assert_eq!(both.remaining(1, 10.0, 0.04), Some(25.0));
    assert_eq!(both.remaining(1, 10.0, f64::NAN), Some(25.0));
    assert_eq!(spp.remaining(0, 0.0, f64::NAN), None);
}

#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_log_gets_a_line_every_ten_seconds() {
    let log = Log::default();
    let goal = Goal {
        seconds: Some(60.0),
        ..Goal::default()
    };
    let mut progress = Progress::log(goal, Box::new(log.clone()));
    for second in 0..25 {
        progress.update(second * 4, second as f64, 0.5);
    }
    progress.finish();
    let lines = String::from_utf8(log.0.lock().unwrap().clone()).unwrap();
    let expected = "40 spp, relative error 0.5000, 00:00:50 left\n\
                    80 spp, relative error 0.5000, 00:00:40 left\n";
    assert_eq!(lines, expected);
}
