//! Work that takes longer than a frame, on a thread of its own: opening a scene, and compiling its passes and loading
//! it onto the GPU. Work whose [`Load`] is dropped goes on without effect, but for reading a file, which stops.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use winit::event_loop::EventLoopProxy;

use super::document::Document;
use super::live::{BuildOrder, Live};
use crate::cli::ViewArgs;
use crate::error::{Error, Result};
use crate::interrupt::is_interrupted;
use crate::output::check_inputs_stay;
use crate::regular_file::Version;
use crate::scene::volume::{Preview, Reading, Volume};
use crate::scene::{Edit, open};

/// Work under way.
pub struct Load<T> {
    pub what: String,
    began: Instant,
    /// The progress of reading the file, if a file is read.
    reading: Option<Arc<Reading>>,
    receiver: Receiver<Result<T>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Load<T> {
    fn begin(
        what: String,
        proxy: &EventLoopProxy<()>,
        reading: Option<Arc<Reading>>,
        work: impl FnOnce() -> Result<T> + Send + 'static,
    ) -> Load<T> {
        let (sender, receiver) = channel();
        let proxy = proxy.clone();
        let thread = thread::spawn(move || {
            // The receiver may be gone: the window was closed, or waits for something else.
            let _ = sender.send(work());
            let _ = proxy.send_event(());
        });
        Load {
            what,
            began: Instant::now(),
            reading,
            receiver,
            thread: Some(thread),
        }
    }

    pub fn took(&self) -> Duration {
        self.began.elapsed()
    }

    /// The share of the file that has been read.
    pub fn share(&self) -> Option<f64> {
        self.reading.as_ref().map(|reading| reading.share())
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

    /// Waits for the work to end.
    pub fn join(mut self) {
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been reported already.
            let _ = thread.join();
        }
    }
}

impl<T> Drop for Load<T> {
    fn drop(&mut self) {
        if let Some(reading) = &self.reading {
            reading.stop();
        }
    }
}

/// Opens a scene file or a volume.
pub fn open_document(
    path: PathBuf,
    edits: Vec<Edit>,
    args: &ViewArgs,
    proxy: &EventLoopProxy<()>,
) -> Load<Document> {
    let name = path.file_name().unwrap_or(path.as_os_str());
    let what = format!("Opening {}", name.to_string_lossy());
    let reading = Arc::new(Reading::default());
    let (preset, stats) = (args.scene.preset, args.stats.clone());
    let is_closed = Arc::new(AtomicBool::new(false));
    let stores = args.scene.cache.stores(args.quiet, {
        let is_closed = is_closed.clone();
        move || is_interrupted() || is_closed.load(Ordering::Relaxed)
    });
    Load::begin(what, proxy, Some(reading.clone()), move || {
        let version = Version::at(&path);
        let opened = open(&path, preset, &edits, |path, overrides| {
            Volume::load_watched(path, overrides, &reading, stores.as_ref())
        })?;
        check_inputs_stay(&stats, &opened.inputs()?)?;
        Ok(Document {
            histogram: opened.volume.histogram_of_data()?,
            path,
            version,
            edits,
            opened,
            is_closed,
        })
    })
}

/// Lists the volumes of a folder or file.
pub fn list_series(path: PathBuf, proxy: &EventLoopProxy<()>) -> Load<Vec<Preview>> {
    let what = "Listing the series".into();
    Load::begin(what, proxy, None, move || Volume::previews(&path))
}

/// Chooses a variant for a scene and brings it onto the GPU.
pub fn build(order: BuildOrder, document: Arc<Document>, proxy: &EventLoopProxy<()>) -> Load<Live> {
    Load::begin("Preparing the scene".into(), proxy, None, move || {
        Live::build(order, &document)
    })
}
