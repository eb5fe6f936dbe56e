//! How and when a frame was taken: what may tell apart frames at one place that are alike otherwise.

use super::holders::Holders;
use super::tags::{self, Tag};

/// What a scanner is set to, or waits for: its name, its unit, and its elements, of which the first is written as text.
pub struct Quantity {
    name: &'static str,
    unit: &'static str,
    sequence: Tag,
    text: Tag,
    double: Tag,
}

pub const QUANTITIES: [Quantity; 4] = [
    Quantity {
        name: "echo time",
        unit: "ms",
        sequence: tags::MR_ECHO,
        text: tags::ECHO_TIME,
        double: tags::EFFECTIVE_ECHO_TIME,
    },
    Quantity {
        name: "inversion time",
        unit: "ms",
        sequence: tags::MR_MODIFIER,
        text: tags::INVERSION_TIME,
        double: tags::INVERSION_TIMES,
    },
    Quantity {
        name: "flip angle",
        unit: "degrees",
        sequence: tags::MR_TIMING,
        text: tags::FLIP_ANGLE,
        double: tags::FLIP_ANGLE,
    },
    Quantity {
        name: "trigger time",
        unit: "ms",
        sequence: tags::CARDIAC_SYNCHRONIZATION,
        text: tags::TRIGGER_TIME,
        double: tags::TRIGGER_DELAY,
    },
];

/// The value of each of [`QUANTITIES`] that is stated, which is 0 or more: the bits of such numbers have their order.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Setting([Option<u64>; QUANTITIES.len()]);

impl Setting {
    pub fn of(holders: &Holders) -> Setting {
        Setting(QUANTITIES.map(|quantity| {
            let text = holders.text(quantity.sequence, quantity.text);
            let number = text.and_then(|text| text.parse().ok());
            let number = number.or_else(|| holders.double(quantity.sequence, quantity.double));
            number
                .filter(|number: &f64| *number >= 0.0)
                .map(f64::to_bits)
        }))
    }

    /// The value of quantity number `n`, by numbers that have its order.
    pub fn number(&self, n: usize) -> Option<u64> {
        self.0[n]
    }

    /// Each quantity's name, and its value; empty where none is stated.
    pub fn told(&self) -> [(&'static str, String); QUANTITIES.len()] {
        let told = |i: usize| {
            let Quantity { name, unit, .. } = QUANTITIES[i];
            let value = self.0[i].map(|bits| format!("{} {unit}", f64::from_bits(bits)));
            (name, value.unwrap_or_default())
        };
        std::array::from_fn(told)
    }
}

/// The date and time at which a frame was taken, as texts whose order is that of time; empty if no time is stated.
pub fn acquired(holders: &Holders) -> String {
    let content = tags::FRAME_CONTENT;
    let whole = [tags::FRAME_ACQUISITION_TIME, tags::ACQUISITION_DATE_TIME];
    let stated = whole.into_iter().find_map(|tag| holders.text(content, tag));
    stated.unwrap_or_else(|| {
        let [date, time] = [tags::ACQUISITION_DATE, tags::ACQUISITION_TIME]
            .map(|tag| holders.text(content, tag).unwrap_or_default());
        if time.is_empty() { time } else { date + &time }
    })
}
