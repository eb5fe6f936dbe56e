//! The key `volume.series` in a scene file: a number or a UID.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};

use crate::scene::volume::Pick;

impl Serialize for Pick {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Pick::Number(number) => serializer.serialize_u32(*number),
            Pick::Uid(uid) => serializer.serialize_str(uid),
        }
    }
}

impl<'de> Deserialize<'de> for Pick {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Pick, D::Error> {
        struct Either;

        impl Visitor<'_> for Either {
            type Value = Pick;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number from 1 to 4294967295 or a SeriesInstanceUID")
            }

            fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Pick, E> {
                let wrong = || E::invalid_value(serde::de::Unexpected::Signed(number), &self);
                let found = u32::try_from(number).ok().filter(|number| *number > 0);
                found.map(Pick::Number).ok_or_else(wrong)
            }

            fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Pick, E> {
                self.visit_i64(i64::try_from(number).unwrap_or(0))
            }

            fn visit_str<E: serde::de::Error>(self, uid: &str) -> Result<Pick, E> {
                Ok(Pick::Uid(uid.to_string()))
            }
        }
        deserializer.deserialize_any(Either)
    }
}
