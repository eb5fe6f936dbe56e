//! What is left to do, and how a log is told.

use std::io::{self, Write};
use std::num::NonZeroU32;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use isolume::engine::{self, Sampled, Stop};
use isolume::output::progress::ProgressLine;

/// `relative_error` is not finite as long as it is unknown.
fn sampled(samples: u32, seconds: f64, relative_error: f64) -> Sampled {
    Sampled {
        first_sample: 0,
        samples,
        units: samples,
        took: Duration::from_secs_f64(seconds),
        seconds_per_sample: seconds / f64::from(samples),
        relative_error,
    }
}

#[test]
fn the_goal_that_comes_first_decides_what_remains() {
    let spp = Stop::at_samples(NonZeroU32::new(100).unwrap());
    assert_eq!(spp.seconds_left(&sampled(25, 10.0, f64::NAN)), Some(30.0));
    let after_filling = Sampled {
        took: Duration::from_secs(60 + 10),
        ..sampled(25, 10.0, f64::NAN)
    };
    assert_eq!(spp.seconds_left(&after_filling), Some(30.0));
    let error = Stop {
        relative_error: Some(0.02),
        ..Stop::default()
    };
    // Half the error takes four times as long.
    assert_eq!(error.seconds_left(&sampled(1, 10.0, 0.04)), Some(30.0));
    assert_eq!(error.seconds_left(&sampled(1, 10.0, 0.01)), Some(0.0));
    assert_eq!(error.seconds_left(&sampled(1, 10.0, f64::INFINITY)), None);
    let both = Stop {
        time: Some(Duration::from_secs(35)),
        ..error
    };
    assert_eq!(both.seconds_left(&sampled(1, 10.0, 0.04)), Some(25.0));
    assert_eq!(both.seconds_left(&sampled(1, 10.0, f64::NAN)), Some(25.0));
    assert_eq!(spp.seconds_left(&sampled(0, 0.0, f64::NAN)), None);
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
    let stop = Stop {
        time: Some(Duration::from_secs(60)),
        ..Stop::default()
    };
    let mut progress = ProgressLine::log(stop, Box::new(log.clone()));
    // Two pictures of an orbit.
    for number in 1..3 {
        progress.begin_picture(number, 2);
        for second in 0..25 {
            let so_far = sampled(second * 4, f64::from(second), 0.5);
            progress.show(engine::Progress::Unit(so_far));
        }
    }
    progress.finish();
    let lines = String::from_utf8(log.0.lock().unwrap().clone()).unwrap();
    let expected = "picture 1 of 2: 40 spp, relative error 0.5000, 00:00:50 left\n\
                    picture 1 of 2: 80 spp, relative error 0.5000, 00:00:40 left\n";
    assert_eq!(
        lines,
        expected.to_owned() + &expected.replace("1 of", "2 of")
    );
}
