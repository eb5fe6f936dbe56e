//! Nobody learns from a volume who the patient is.

use isolume::scene::volume::{Volume, VolumeOverrides};

use super::{folder, refused};
use crate::dicom_files::Syntax;
use crate::dicom_scan::{SECRET, Scan};
use crate::volume_files::write;

#[test]
fn no_name_reaches_a_volume_or_a_message() {
    for syntax in [Syntax::Explicit, Syntax::Implicit, Syntax::BigEndian] {
        let scan = Scan::ct().with_names();
        let folder = folder();
        scan.write(folder.path(), syntax, |n| n.to_string());
        let volume = Volume::load(folder.path(), &VolumeOverrides::default()).unwrap();
        assert!(!format!("{volume:?}").contains(SECRET));
        let series = Volume::series(folder.path()).unwrap();
        assert!(!format!("{series:?}").contains(SECRET));
        let bytes = scan.slice_file(0, syntax);
        for length in (0..bytes.len()).step_by(7) {
            let path = write(folder.path(), "cut.dcm", &bytes[..length]);
            let message = refused(&path, &VolumeOverrides::default());
            assert!(!message.contains(SECRET), "{message}");
        }
    }
}
