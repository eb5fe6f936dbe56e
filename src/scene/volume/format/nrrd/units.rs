//! The units of a NRRD's lengths: `space units` are those of the coordinates of `space directions`, `units` those of the axes.

use crate::scene::volume::format::text::Fields;
use crate::scene::volume::storage::symbol;

/// A unit for each of the places x, y and z; `None` where it is not stated.
pub struct Units<'a>(pub [Option<&'a str>; 3]);

impl<'a> Units<'a> {
    /// Those that a field names, each in quotation marks, for the coordinates or axes that are x, y and z.
    pub fn read(fields: &'a Fields, key: &str, places: [usize; 3]) -> Units<'a> {
        let text = fields.get(key).unwrap_or_default();
        let named: Vec<&str> = text.split('"').skip(1).step_by(2).map(str::trim).collect();
        let is_unit = |name: &&str| !matches!(*name, "" | "???" | "none");
        Units(places.map(|place| named.get(place).copied().filter(is_unit)))
    }

    /// The unit of x, which becomes that of all lengths.
    pub fn symbol(&self) -> Option<String> {
        self.0[0].map(symbol)
    }
}
