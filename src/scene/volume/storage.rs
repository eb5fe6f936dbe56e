//! How a file stores a volume, and which part of it is shown, as users are told it.

use serde::Serialize;

/// A field is empty or `None` where a format does not have it.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Storage {
    pub format: &'static str,
    /// `None` if there is none.
    pub compression: Option<String>,
    /// The unit of the spacing.
    pub unit: Option<String>,
    /// Names of the channels, or "" for those that have none.
    pub channels: Vec<String>,
    pub times: u32,
    /// The resolutions, the finest first.
    pub levels: Vec<Level>,
    /// Index of the channel that is the volume.
    pub channel: Option<u32>,
    pub time: Option<u32>,
    pub level: Option<u32>,
}

/// The whole volume at one resolution.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    pub dims: [u32; 3],
    pub spacing: [f64; 3],
}

impl Storage {
    /// One line for each known property.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let of = |chosen: Option<u32>, count: usize| format!("{} of {count}", chosen.unwrap_or(0));
        let mut lines = vec![("format", self.format.to_string())];
        let compression = self.compression.as_deref().unwrap_or("none");
        lines.push(("compression", compression.to_string()));
        if let Some(unit) = &self.unit {
            lines.push(("unit", unit.clone()));
        }
        if self.channels.len() > 1 {
            let names = self.channels.iter().filter(|name| !name.is_empty());
            let names: Vec<&str> = names.map(String::as_str).collect();
            let names = if names.is_empty() {
                String::new()
            } else {
                format!(" ({})", names.join(", "))
            };
            lines.push(("channel", of(self.channel, self.channels.len()) + &names));
        }
        if self.times > 1 {
            lines.push(("time", of(self.time, self.times as usize)));
        }
        if self.levels.len() > 1 {
            lines.push(("level", of(self.level, self.levels.len())));
            for (n, level) in self.levels.iter().enumerate() {
                let [x, y, z] = level.dims;
                let [a, b, c] = level.spacing;
                lines.push(("", format!("{n}: {x} × {y} × {z}, spacing {a} × {b} × {c}")));
            }
        }
        lines
    }

    /// Remarks for the user on channels and times that are not the volume.
    pub fn notes(&self) -> Vec<String> {
        let channels = self.channels.len() as u32;
        let of = |key: &str, chosen: Option<u32>, count: u32| {
            let chosen = chosen.unwrap_or(0);
            (count > 1).then(|| {
                format!(
                    "{key} {chosen} of {count} is shown; `--set volume.{key}=N` picks another, counted \
                     from 0"
                )
            })
        };
        let channel = of("channel", self.channel, channels);
        let time = of("time", self.time, self.times);
        channel.into_iter().chain(time).collect()
    }
}

/// The power of ten of a unit of length in metres, by the names and signs that files use.
fn decimal(unit: &str) -> Option<i32> {
    Some(match unit.trim() {
        "angstrom" | "Å" => -10,
        "nanometer" | "nanometre" | "nm" => -9,
        "micrometer" | "micrometre" | "micron" | "um" | "µm" | "μm" => -6,
        "millimeter" | "millimetre" | "mm" => -3,
        "centimeter" | "centimetre" | "cm" => -2,
        "meter" | "metre" | "m" => 0,
        _ => return None,
    })
}

/// The sign of a unit of length, or its name as it was given where that is not known.
pub fn symbol(unit: &str) -> String {
    let sign = match decimal(unit) {
        Some(-10) => "Å",
        Some(-9) => "nm",
        Some(-6) => "µm",
        Some(-3) => "mm",
        Some(-2) => "cm",
        Some(0) => "m",
        _ => unit,
    };
    sign.to_string()
}

/// Lengths along x, y and z, given in a unit each, in the unit of x, which is the world unit. If a unit is unknown or
/// the same, its length is unchanged.
pub fn in_one_unit(lengths: [f64; 3], units: [Option<&str>; 3]) -> [f64; 3] {
    let power = |unit: Option<&str>| Some(decimal(unit?)? - decimal(units[0]?)?);
    std::array::from_fn(|a| match power(units[a]).unwrap_or(0) {
        // Both are exact; a negative power of ten would not be.
        power @ 0.. => lengths[a] * 10f64.powi(power),
        power => lengths[a] / 10f64.powi(-power),
    })
}
