//! Work that takes longer than a frame, on a thread of its own: opening a scene, and compiling its passes and loading
//! it onto the GPU. A result that is no longer wanted is ignored by dropping its receiver.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use winit::event_loop::EventLoopProxy;

use super::document::Document;
use super::live::{Live, Order};
use crate::error::{Error, Result};
use crate::scene::preset::Preset;
use crate::scene::volume::{Preview, Reading, Stores, Volume};
use crate::scene::{Edit, open};

/// Bins of the transfer function's histogram.
const BINS: usize = 256;

/// Builds under way; some may no longer be wanted.
static BUILDS: Mutex<Vec<JoinHandle<()>>> = Mutex::new(Vec::new());

/// Waits for all builds to end: a process that ends while its driver compiles may crash.
pub fn wait_for_builds() {
    let builds = std::mem::take(&mut *BUILDS.lock().unwrap_or_else(PoisonError::into_inner));
    for build in builds {
        // A panic of the thread has been reported already.
        let _ = build.join();
    }
}

/// Work under way.
pub struct Load<T> {
    pub what: String,
    began: Instant,
    /// The progress of reading the file, if a file is read.
    reading: Option<Arc<Reading>>,
    receiver: Receiver<Result<T>>,
}

impl<T: Send + 'static> Load<T> {
    fn begin(
        what: String,
        proxy: &EventLoopProxy<()>,
        reading: Option<Arc<Reading>>,
        work: impl FnOnce() -> Result<T> + Send + 'static,
    ) -> (Load<T>, JoinHandle<()>) {
        let (sender, receiver) = channel();
        let proxy = proxy.clone();
        let thread = thread::spawn(move || {
            // The receiver may be gone: the window was closed, or waits for something else.
            let _ = sender.send(work());
            let _ = proxy.send_event(());
        });
        let load = Load {
            what,
            began: Instant::now(),
            reading,
            receiver,
        };
        (load, thread)
    }

    pub fn took(&self) -> Duration {
        self.began.elapsed()
    }

    /// The share of the file that has been read.
    pub fn share(&self) -> Option<f64> {
        self.reading.as_ref().map(|reading| reading.share())
    }

    /// Stops reading a file that is no longer wanted.
    pub fn stop(&self) {
        if let Some(reading) = &self.reading {
            reading.stop();
        }
    }

    /// The result, once it is there.
    pub fn result(&self) -> Option<Result<T>> {
        match self.receiver.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(Error::value(format!(
                "{} ended without a result",
                self.what
            )))),
        }
    }
}

/// Opens a scene file or a volume.
pub fn open_document(
    path: PathBuf,
    preset: Preset,
    edits: Vec<Edit>,
    stores: Option<Stores>,
    proxy: &EventLoopProxy<()>,
) -> Load<Document> {
    let name = path.file_name().unwrap_or(path.as_os_str());
    let what = format!("Opening {}", name.to_string_lossy());
    let reading = Arc::new(Reading::default());
    let (load, _) = Load::begin(what, proxy, Some(reading.clone()), move || {
        let opened = open(&path, preset, &edits, |path, overrides| {
            Volume::load_watched(path, overrides, &reading, stores.as_ref())
        })?;
        Ok(Document {
            histogram: opened.volume.histogram(BINS)?,
            path,
            edits,
            opened,
        })
    });
    load
}

/// Lists the volumes of a folder or file.
pub fn list_series(path: PathBuf, proxy: &EventLoopProxy<()>) -> Load<Vec<Preview>> {
    let what = "Listing the series".into();
    let (load, _) = Load::begin(what, proxy, None, move || Volume::previews(&path));
    load
}

/// Chooses a variant for a scene and brings it onto the GPU.
pub fn build(order: Order, document: Arc<Document>, proxy: &EventLoopProxy<()>) -> Load<Live> {
    let (load, thread) = Load::begin("Preparing the scene".into(), proxy, None, move || {
        Live::build(order, &document)
    });
    let mut builds = BUILDS.lock().unwrap_or_else(PoisonError::into_inner);
    builds.retain(|build| !build.is_finished());
    builds.push(thread);
    load
}
