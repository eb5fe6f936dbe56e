//! Where the elements of a frame are looked up: in its own groups, in those of all frames, and in the object.

use crate::scene::volume::parsed::Parsed;

use super::data_set::DataSet;
use super::tags::{self, Tag};

/// The data sets that describe a frame: what the first of them says counts.
pub struct Holders<'a>(Vec<&'a DataSet>);

impl<'a> Holders<'a> {
    /// `own` is the frame's item among the groups of an enhanced object.
    pub fn new(own: Option<&'a DataSet>, data: &'a DataSet) -> Holders<'a> {
        let shared = data.item(tags::SHARED_GROUPS);
        let detector = data.item(tags::DETECTORS);
        let holders = [own, shared, Some(data), detector];
        Holders(holders.into_iter().flatten().collect())
    }

    /// The sequence's item in each data set that has one, and then the data sets themselves, as in a classic object.
    fn holders(&self, sequence: Tag) -> impl Iterator<Item = &'a DataSet> {
        let items = self.0.iter().filter_map(move |data| data.item(sequence));
        items.chain(self.0.iter().copied())
    }

    pub fn text(&self, sequence: Tag, tag: Tag) -> Option<String> {
        self.holders(sequence).find_map(|holder| holder.text(tag))
    }

    pub fn whole(&self, sequence: Tag, tag: Tag) -> Option<u32> {
        self.holders(sequence).find_map(|holder| holder.whole(tag))
    }

    pub fn double(&self, sequence: Tag, tag: Tag) -> Option<f64> {
        self.holders(sequence).find_map(|holder| holder.double(tag))
    }

    pub fn decimals<const N: usize>(
        &self,
        sequence: Tag,
        tag: Tag,
        name: &str,
    ) -> Parsed<Option<[f64; N]>> {
        let mut holders = self.holders(sequence);
        let found = holders.find_map(|holder| holder.decimals(tag, name).transpose());
        found.transpose()
    }

    pub fn decimal(&self, sequence: Tag, tag: Tag, name: &str) -> Parsed<Option<f64>> {
        let found = self.decimals::<1>(sequence, tag, name)?;
        Ok(found.map(|[number]| number))
    }

    pub fn doubles<const N: usize>(&self, sequence: Tag, tag: Tag) -> Option<[f64; N]> {
        let mut holders = self.holders(sequence);
        holders.find_map(|holder| holder.doubles(tag))
    }
}
