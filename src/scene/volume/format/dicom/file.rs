//! One file: whether it is DICOM, and its header up to the pixels.
//!
//! A header is a few kilobytes before pixels of any length, and only the header is read here, so that a folder of
//! thousands of files is examined in a second.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::read::DeflateDecoder;

use super::data_set::{DataSet, numeric};
use super::elements::{self, Pixels};
use super::stream::Stream;
use super::syntax::{
    EXPLICIT_LITTLE, GDCMCONV, IMPLICIT_LITTLE, PLAIN, Syntax, TransferSyntax, transfer_syntax,
};
use super::tags;
use crate::regular_file::{HAS_CHANGED, Version, open_file};
use crate::scene::volume::parsed::Parsed;

const PREAMBLE: u64 = 128;
const MAGIC: &[u8] = b"DICM";

/// A file with its header.
#[derive(Debug)]
pub struct Parsing {
    pub place: FilePart,
    pub data_set: DataSet,
    pub transfer: TransferSyntax,
    pub pixels: Option<Pixels>,
}

/// A file, and the location of its pixels.
#[derive(Debug, Clone)]
pub struct FilePart {
    pub path: PathBuf,
    /// The file's path relative to the folder that the user has named; empty for a file that the user has named.
    pub name: String,
    version: Version,
    /// Offset of the data set.
    begin: u64,
    pub is_deflated: bool,
}

/// The beginning of a file.
enum Beginning {
    /// The meta information, at this byte.
    Meta(u64),
    /// The data set itself, as in very old files.
    DataSet(Syntax),
    /// Anything else.
    Other,
}

/// The reason why a header could not be read.
pub enum Fault {
    /// The system does not return its bytes: the file may be anything, even a slice of the volume.
    System(String),
    /// It is damaged, or of an unknown kind.
    Content(String),
}

impl From<Fault> for String {
    fn from(fault: Fault) -> String {
        match fault {
            Fault::System(fault) | Fault::Content(fault) => fault,
        }
    }
}

/// Reads a file's header; `None` if the file is not DICOM.
pub fn parse(path: &Path) -> Result<Option<Parsing>, Fault> {
    let (file, metadata) = open_file(path).map_err(Fault::System)?;
    let copy = file.try_clone();
    let mut stream = Stream::new(copy.map_err(|e| Fault::System(e.to_string()))?);
    let parsed = parse_open(path, file, Version::of(&metadata), &mut stream);
    match stream.failure {
        Some(failure) => Err(Fault::System(failure)),
        None => parsed.map_err(Fault::Content),
    }
}

/// The header of an open file, whose bytes are in `stream`.
fn parse_open(
    path: &Path,
    mut file: File,
    version: Version,
    stream: &mut Stream,
) -> Parsed<Option<Parsing>> {
    let (begin, transfer) = match beginning(stream, version.bytes)? {
        Beginning::Other => return Ok(None),
        Beginning::DataSet(syntax) => (0, TransferSyntax { syntax, ..PLAIN }),
        Beginning::Meta(at) => {
            let (meta, end) = elements::read_group(stream, at, 2)?;
            (end, transfer_of(&meta, stream, end)?)
        }
    };
    if transfer.is_deflated {
        file.seek(SeekFrom::Start(begin))
            .map_err(|e| e.to_string())?;
        *stream = Stream::new(DeflateDecoder::new(file));
    }
    let at = if transfer.is_deflated { 0 } else { begin };
    let (data_set, pixels) = match elements::read(stream, at, transfer.syntax) {
        Ok(read) => read,
        // It only happened to begin like a data set.
        Err(_) if begin == 0 && !transfer.is_deflated => return Ok(None),
        Err(fault) => return Err(fault),
    };
    if begin == 0 && pixels.is_none() && !data_set.has(tags::SOP_CLASS) {
        return Ok(None);
    }
    Ok(Some(Parsing {
        place: FilePart {
            path: path.to_path_buf(),
            name: String::new(),
            version,
            begin,
            is_deflated: transfer.is_deflated,
        },
        data_set,
        transfer,
        pixels,
    }))
}

fn beginning(stream: &mut Stream, length: u64) -> Parsed<Beginning> {
    let bytes = stream.bytes(0, PREAMBLE + 8)?;
    if (bytes.len() as u64) < length.min(PREAMBLE + 8) {
        return Err(HAS_CHANGED.into());
    }
    if bytes.get(PREAMBLE as usize..PREAMBLE as usize + MAGIC.len()) == Some(MAGIC) {
        return Ok(Beginning::Meta(PREAMBLE + 4));
    }
    if bytes.starts_with(MAGIC) {
        return Ok(Beginning::Meta(4));
    }
    let Some(head) = bytes.first_chunk::<8>() else {
        return Ok(Beginning::Other);
    };
    let is_typed = tags::TYPES.contains(&[head[4], head[5]]);
    let implicit = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
    // The first element of an object is one of group 8, and a short one.
    Ok(match (head[0], head[1]) {
        (2, 0) if is_typed => Beginning::Meta(0),
        (8, 0) if is_typed => Beginning::DataSet(Syntax::EXPLICIT),
        (0, 8) if is_typed => Beginning::DataSet(Syntax::BIG),
        (8, 0) if head[3] == 0 && u64::from(implicit) < length.min(1 << 10) => {
            Beginning::DataSet(Syntax::IMPLICIT)
        }
        _ => Beginning::Other,
    })
}

/// The transfer syntax. Writers that leave it out use the implicit or the explicit one.
fn transfer_of(meta: &DataSet, stream: &mut Stream, end: u64) -> Parsed<TransferSyntax> {
    let uid = match meta.text(tags::TRANSFER_SYNTAX) {
        Some(uid) => uid,
        None => {
            let head = stream.exactly(end, 8)?;
            let is_typed = tags::TYPES.contains(&[head[4], head[5]]);
            let uid = if is_typed {
                EXPLICIT_LITTLE
            } else {
                IMPLICIT_LITTLE
            };
            uid.to_string()
        }
    };
    transfer_syntax(&uid).ok_or_else(|| {
        let found = numeric(&uid);
        format!("its transfer syntax is `{found}`, which is not known here; {GDCMCONV}")
    })
}

impl FilePart {
    /// Opens the file, if it has not changed since its header was read.
    pub fn open(&self) -> Parsed<File> {
        let (file, _) = open_file(&self.path)?;
        self.version.check(&file).map(|()| file)
    }

    pub fn bytes(&self) -> u64 {
        self.version.bytes
    }

    /// Fills `bytes` with the bytes of the data set from `at` on.
    pub fn read(&self, at: u64, bytes: &mut [u8]) -> Parsed<()> {
        let file = self.open()?;
        self.read_from(&file, at, bytes)?;
        // It may have been overwritten meanwhile.
        self.version.check(&file)
    }

    fn read_from(&self, mut file: &File, at: u64, bytes: &mut [u8]) -> Parsed<()> {
        let wanted = bytes.len();
        let failed = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                format!("ends before its pixels do: {wanted} bytes from byte {at} on are missing")
            }
            _ => format!("cannot read its pixels: {e}"),
        };
        if self.is_deflated {
            file.seek(SeekFrom::Start(self.begin)).map_err(failed)?;
            let mut inflated = DeflateDecoder::new(file);
            let skipped = std::io::copy(&mut inflated.by_ref().take(at), &mut std::io::sink());
            skipped.map_err(failed)?;
            return inflated.read_exact(bytes).map_err(failed);
        }
        file.seek(SeekFrom::Start(at)).map_err(failed)?;
        file.read_exact(bytes).map_err(failed)
    }
}
