//! The page in plain text.

use super::Examination;
use super::closed_forms::Measured;
use crate::bytes::human;
use crate::render::PeakRates;

pub fn page(examinations: &[Examination]) -> String {
    let mut text = format!(
        "isolume {} on {} {}\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH
    );
    for examination in examinations {
        text += &part(examination);
    }
    text
}

fn part(examination: &Examination) -> String {
    let device = &examination.device;
    let mut text = format!(
        "\n{}: {} ({})\ndriver {}, Vulkan {}, {} of device-local memory\nimages of {} texels a side in 3D and {} in 2D, buffers of {}, allocations of {}\n",
        device.index,
        device.name,
        device.kind,
        device.driver.trim(),
        device.api,
        human(device.device_local_bytes),
        device.max_image_3d,
        device.max_image_2d,
        human(device.max_storage_buffer_bytes),
        human(device.max_allocation_bytes),
    );
    text += "\nneeds\n";
    for need in &device.needs {
        let state = match (need.holds, need.fallback) {
            (true, _) => "ok",
            (false, Some(_)) => "no",
            (false, None) => "FAIL",
        };
        text += &format!(
            "  {state:<5}{:<36} {:<26} for {}\n",
            need.name, need.found, need.reason
        );
        if let (false, Some(fallback)) = (need.holds, need.fallback) {
            text += &format!("       without it, {fallback}\n");
        }
    }
    text += &filters(examination);
    text += &timestamps(examination);
    text += &closed_forms(examination);
    if let Some(rates) = &examination.rates {
        text += &rates_table(rates);
    }
    if let Some(fault) = &examination.fault {
        text += &format!("\nFAIL the examination ended early: {fault}\n");
    }
    let (left_out, is_usable) = (
        examination.left_out.len(),
        examination.device.lacks.is_empty(),
    );
    let verdict = verdict(examination.holds, is_usable, left_out);
    text + &format!("\n{verdict}; {:.1} s\n", examination.seconds)
}

fn filters(examination: &Examination) -> String {
    let mut text = String::new();
    for filter in &examination.filters {
        let error = match filter.error {
            None => "absent".to_string(),
            Some(error) => format!("off by {error:.5} of a voxel at most"),
        };
        text += &format!("  {:<12} {error}\n", filter.format);
    }
    if text.is_empty() {
        text
    } else {
        format!(
            "\nerror of the device's filter, which only the variant published uses (shaders interpolate voxels themselves)\n{text}"
        )
    }
}

fn timestamps(examination: &Examination) -> String {
    let Some(times) = &examination.timestamps else {
        return String::new();
    };
    format!(
        "\ntimestamps\n  {} a long dispatch took {:.1} ms by them and {:.1} ms by the host's clock\n",
        state(times.holds),
        1e3 * times.by_device_s,
        1e3 * times.by_host_s
    )
}

fn closed_forms(examination: &Examination) -> String {
    let mut text = String::new();
    for form in &examination.closed_forms {
        let Measured {
            name,
            exact,
            measured,
            stderr,
            tolerance,
        } = &form.measurement;
        let state = match (form.holds, form.decided) {
            (true, false) => "?   ",
            (holds, _) => state(holds),
        };
        text += &format!(
            "  {state} {name:<38} {measured:>9.6} ± {stderr:.6}, expected {exact:>9.6} ± {tolerance:.6}  ({:.1} s)\n",
            form.seconds
        );
    }
    if examination.closed_forms.iter().any(|form| !form.decided) {
        text += "  ? means that nothing contradicts the exact value, but there was time for too few samples to confirm it\n";
    }
    for name in &examination.left_out {
        text += &format!("  left out, since the device is slow: {name}\n");
    }
    if text.is_empty() {
        text
    } else {
        format!("\nclosed forms\n{text}")
    }
}

fn state(holds: bool) -> &'static str {
    if holds { "ok  " } else { "FAIL" }
}

fn rates_table(rates: &PeakRates) -> String {
    let beyond = human(rates.volume_bytes);
    let million =
        |name: String, rate: f64| format!("  {name:<44} {:>11.1} million/s\n", rate * 1e-6);
    [
        "\npeak rates\n".to_string(),
        million(
            "trilinear samples, volume in cache".into(),
            rates.peak.samples_cached,
        ),
        million(
            format!("trilinear samples, volume of {beyond}"),
            rates.samples,
        ),
        million(
            "voxel reads, volume in cache".into(),
            rates.peak.reads_cached,
        ),
        million(format!("voxel reads, volume of {beyond}"), rates.reads),
        million(
            "writes of four floats to an image".into(),
            rates.peak.writes,
        ),
        format!(
            "  {:<44} {:>11.2} GB/s\n",
            "copies on the device",
            rates.peak.copied_bytes * 1e-9
        ),
        format!(
            "  {:<44} {:>11.1} µs\n",
            "a dispatch that does nothing",
            rates.dispatch_s * 1e6
        ),
    ]
    .concat()
}

/// The last line. A check that was left out for want of time does not count against the device.
fn verdict(holds: bool, is_usable: bool, left_out: usize) -> String {
    let verdict = match (holds, is_usable) {
        (true, _) if left_out > 0 => "all checks that were run passed",
        (true, _) => "all checks passed",
        (false, true) => "at least one check failed",
        (false, false) => "Isolume cannot use this device",
    };
    match left_out {
        0 => verdict.to_string(),
        1 => format!("{verdict}, 1 check was left out for want of time"),
        count => format!("{verdict}, {count} checks were left out for want of time"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_line_counts_what_was_left_out() {
        assert_eq!(verdict(true, true, 0), "all checks passed");
        assert_eq!(
            verdict(true, true, 2),
            "all checks that were run passed, 2 checks were left out for want of time"
        );
        assert_eq!(
            verdict(false, true, 1),
            "at least one check failed, 1 check was left out for want of time"
        );
    }
}
