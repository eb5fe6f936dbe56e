//! How a file stores a volume, and which part of it is shown, as users are told it.

use serde::Serialize;

/// The most channels whose names are kept or listed: a few bytes of a file can promise billions of channels.
pub const MOST_NAMES: u32 = 1 << 16;

/// A field is empty or `None` where a format does not have it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Storage {
    pub format: &'static str,
    /// `None` if there is none.
    pub compression: Option<String>,
    /// The unit of the spacing.
    pub unit: Option<String>,
    pub channels: u32,
    /// Names of the first channels, as far as there are names; "" for one that has none.
    pub channel_names: Vec<String>,
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
        let of = |chosen: Option<u32>, count: u32| format!("{} of {count}", chosen.unwrap_or(0));
        let mut lines = vec![("format", self.format.to_string())];
        let compression = self.compression.as_deref().unwrap_or("none");
        lines.push(("compression", compression.to_string()));
        if let Some(unit) = &self.unit {
            lines.push(("unit", unit.clone()));
        }
        if self.channels > 1 {
            let names = self.channel_names.iter().filter(|name| !name.is_empty());
            let names: Vec<&str> = names.map(String::as_str).collect();
            let names = if names.is_empty() {
                String::new()
            } else {
                format!(" ({})", names.join(", "))
            };
            lines.push(("channel", of(self.channel, self.channels) + &names));
        }
        if self.times > 1 {
            lines.push(("time", of(self.time, self.times)));
        }
        if self.levels.len() > 1 {
            lines.push(("level", of(self.level, self.levels.len() as u32)));
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
        let of = |key: &str, chosen: Option<u32>, count: u32| {
            let chosen = chosen.unwrap_or(0);
            (count > 1).then(|| {
                format!(
                    "{key} {chosen} of {count} is shown; `--set volume.{key}=N` picks another, counted \
                     from 0"
                )
            })
        };
        let channel = of("channel", self.channel, self.channels);
        let time = of("time", self.time, self.times);
        channel.into_iter().chain(time).collect()
    }
}

/// A unit of length: `count` times 10 to the power of `power` metres.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Unit {
    count: u32,
    power: i32,
    sign: &'static str,
}

impl Unit {
    /// By the names and signs that files use.
    fn named(name: &str) -> Option<Unit> {
        let (count, power, sign) = match name.trim() {
            "picometer" | "picometre" | "pm" => (1, -12, "pm"),
            "angstrom" | "Å" => (1, -10, "Å"),
            "nanometer" | "nanometre" | "nm" => (1, -9, "nm"),
            "micrometer" | "micrometre" | "micron" | "microns" | "um" | "µm" | "μm" => {
                (1, -6, "µm")
            }
            "millimeter" | "millimetre" | "mm" => (1, -3, "mm"),
            "centimeter" | "centimetre" | "cm" => (1, -2, "cm"),
            "decimeter" | "decimetre" | "dm" => (1, -1, "dm"),
            "meter" | "metre" | "m" => (1, 0, "m"),
            "kilometer" | "kilometre" | "km" => (1, 3, "km"),
            "inch" | "in" => (254, -4, "in"),
            "foot" | "ft" => (3048, -4, "ft"),
            "yard" | "yd" => (9144, -4, "yd"),
            _ => return None,
        };
        Some(Unit { count, power, sign })
    }

    /// A length in this unit in another one.
    fn in_unit(self, length: f64, other: Unit) -> f64 {
        if self == other {
            return length;
        }
        let counted = length * f64::from(self.count);
        // Positive powers of ten are exact, and negative ones are not.
        let scaled = match self.power - other.power {
            power @ 0.. => counted * 10f64.powi(power),
            power => counted / 10f64.powi(-power),
        };
        scaled / f64::from(other.count)
    }
}

/// The sign of a unit of length, or its name as it was given where that is not known.
pub fn symbol(unit: &str) -> String {
    let sign = Unit::named(unit).map_or(unit, |unit| unit.sign);
    sign.to_string()
}

/// Lengths along x, y and z, given in a unit each, in the unit of x, which is the world unit. If a unit is unknown or
/// the same, its length is unchanged.
pub fn in_one_unit(lengths: [f64; 3], units: [Option<&str>; 3]) -> [f64; 3] {
    let units = units.map(|unit| Unit::named(unit?));
    std::array::from_fn(|a| match (units[a], units[0]) {
        (Some(own), Some(of_x)) => own.in_unit(lengths[a], of_x),
        _ => lengths[a],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_in_several_units_become_those_of_x() {
        let of = |units: [&str; 3]| in_one_unit([1.0, 2.0, 3.0], units.map(Some));
        assert_eq!(of(["mm", "mm", "inch"]), [1.0, 2.0, 76.2]);
        assert_eq!(of(["pm", "micrometer", "nm"]), [1.0, 2e6, 3e3]);
        assert_eq!(of(["m", "dm", "cm"]), [1.0, 0.2, 0.03]);
        assert_eq!(in_one_unit([1.0, 0.1, 1.0], [Some("in"); 3])[1], 0.1);
        assert_eq!(
            in_one_unit([1.0, 2.0, 3.0], [Some("mm"), None, Some("ell")]),
            [1.0, 2.0, 3.0]
        );
    }
}
