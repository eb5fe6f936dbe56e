//! Numbers of bytes as people read them.

/// "1.5 GiB", for messages.
pub fn human(bytes: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let power = (bytes.max(1).ilog2() / 10).min(4);
    match power {
        0 => format!("{bytes} B"),
        _ => format!(
            "{:.1} {}",
            bytes as f64 / 1024f64.powi(power as i32),
            UNITS[power as usize]
        ),
    }
}

/// "1.5 GiB (1610612736 bytes)", where the exact number counts.
pub fn exactly(bytes: u64) -> String {
    format!("{} ({bytes} bytes)", human(bytes))
}
