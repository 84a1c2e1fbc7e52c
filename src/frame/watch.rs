//! Shaders that change while the program runs: a watched folder, and what is compiled from it.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode};
use notify::{Event, EventKind, RecursiveMode, Watcher as _};

use super::{Error, compile, shaders};
use crate::gpu::{Shader, ShaderBuild, ShaderSource};

/// How long must a folder be at rest before it has changed? Editors write a file in several steps, which take less.
const QUIET: Duration = Duration::from_millis(100);

/// After how long has a folder changed that is never at rest?
const RESTLESS: Duration = Duration::from_secs(1);

/// The texts that a shader is made of, by the names of their files; where one cannot be read, why.
type Texts = BTreeMap<String, Result<String, String>>;

/// A folder of shaders that is watched, and compiled from as pipelines ask for it.
pub struct Watcher {
    changed: Arc<AtomicBool>,
    kept: Arc<Kept>,
    // When it goes, so does the thread that it wakes.
    _folder: notify::RecommendedWatcher,
}

impl Watcher {
    /// Watches `folder`, and calls `wake` from another thread whenever a text in it has changed, just after
    /// [`Watcher::changed`] becomes true.
    ///
    /// # Errors
    /// [`Error::Shader`] where it is no folder of shaders, or cannot be watched.
    pub fn new(folder: &Path, wake: impl Fn() + Send + 'static) -> Result<Watcher, Error> {
        let fault = |what: String| Error::Shader(format!("{}: {what}", folder.display()));
        for job in compile::jobs() {
            if let Err(error) = fs::File::open(folder.join(job.file)) {
                return Err(fault(format!(
                    "no folder of shaders, {} is missing ({error}); name the folder shaders of marmor's sources",
                    job.file
                )));
            }
        }
        let (send, events) = channel();
        let watched = notify::recommended_watcher(move |event: notify::Result<Event>| {
            // What was lost with an error may have been a change.
            if event.as_ref().map_or(true, |event| writes(&event.kind)) {
                // The thread ends only after this end has gone.
                let _ = send.send(());
            }
        });
        let watched = watched.and_then(|mut watched| {
            watched.watch(folder, RecursiveMode::NonRecursive)?;
            Ok(watched)
        });
        let watched = watched.map_err(|error| {
            fault(format!(
                "cannot be watched: {error}; run without --watch, or put the shaders on a disk of this machine"
            ))
        })?;
        let compiler = shaderc::Compiler::new()
            .map_err(|error| Error::Shader(format!("shaderc does not start: {error}")))?;
        let watcher = Watcher {
            changed: Arc::default(),
            kept: Arc::new(Kept {
                folder: folder.to_owned(),
                inner: Mutex::new(Inner {
                    compiler,
                    made: HashMap::new(),
                    fit: None,
                    holds: false,
                }),
            }),
            _folder: watched,
        };
        let (folder, changed) = (folder.to_owned(), Arc::clone(&watcher.changed));
        // Read before anyone can rely on being told of changes to it.
        let seen = all(&folder);
        thread::spawn(move || listen(&events, &folder, seen, &changed, &wake));
        Ok(watcher)
    }

    /// Whether a text in the folder has changed since the last call.
    pub fn changed(&self) -> bool {
        self.changed.swap(false, Ordering::AcqRel)
    }

    /// What says which state of the folder its source takes.
    pub fn states(&self) -> States {
        States(Arc::clone(&self.kept))
    }

    /// The shaders of the folder as they are whenever a pipeline is made, for [`crate::gpu::Device::set_shader_source`].
    /// One whose text is that which the program was built from is the program's own; another is compiled, and compiled
    /// again only after a change of its text.
    pub fn source(&self) -> Arc<ShaderSource> {
        let kept = Arc::clone(&self.kept);
        Arc::new(move |shader| kept.words(shader))
    }
}

/// Which state of a watched folder its [`Watcher::source`] takes: that of now, or the last that was fit to draw with.
pub struct States(Arc<Kept>);

impl States {
    /// Takes the texts as they are now, and are from now on.
    pub fn follow(&self) {
        self.0.lock().holds = false;
    }

    /// Notes that the texts as they are now are fit to draw with.
    pub fn accept(&self) {
        let fit = all(&self.0.folder);
        self.0.lock().fit = Some(Arc::new(fit));
    }

    /// Takes those that were last accepted until [`States::follow`]; if there are none, those of now.
    pub fn hold(&self) {
        self.0.lock().holds = true;
    }
}

/// Compiles `shader`, in its build, from the texts in `folder`.
///
/// # Errors
/// The compiler's message, or which file cannot be read.
pub fn compiled(folder: &Path, shader: &Shader) -> Result<Vec<u32>, String> {
    let compiler =
        shaderc::Compiler::new().map_err(|error| format!("shaderc does not start: {error}"))?;
    let job = job(shader)?;
    let texts = texts(job.file, &|name| read(folder, name));
    compile_job(&compiler, &job, shader.build, &texts)
}

/// Whether what happened may have changed a file. That shaders are read is no change, or each would lead to the next.
fn writes(kind: &EventKind) -> bool {
    let closed = AccessKind::Close(AccessMode::Write);
    !matches!(kind, EventKind::Access(access) if *access != closed)
}

/// Says when texts of `folder`, which are `seen`, have changed, until the other end of `events` has gone.
fn listen(
    events: &Receiver<()>,
    folder: &Path,
    mut seen: BTreeMap<PathBuf, Option<String>>,
    changed: &AtomicBool,
    wake: &dyn Fn(),
) {
    while events.recv().is_ok() {
        let first = Instant::now();
        while first.elapsed() < RESTLESS && events.recv_timeout(QUIET).is_ok() {}
        // An editor's own files come and go, and a text may be written as it was.
        let now = all(folder);
        if now != seen {
            seen = now;
            changed.store(true, Ordering::Release);
            wake();
        }
    }
}

/// The texts of every shader in `folder`; none for what cannot be read.
fn all(folder: &Path) -> BTreeMap<PathBuf, Option<String>> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let shaders = paths.filter(|path| compile::is_shader(path));
    shaders
        .map(|path| (path.clone(), fs::read_to_string(path).ok()))
        .collect()
}

/// A folder, and what was compiled of it.
struct Kept {
    folder: PathBuf,
    inner: Mutex<Inner>,
}

/// A compiler, which is not for several threads at once, and the last that it made of each shader.
struct Inner {
    compiler: shaderc::Compiler,
    made: HashMap<(&'static str, ShaderBuild), Made>,
    // The texts that were last accepted, and whether they stand for those of the folder.
    fit: Option<Arc<BTreeMap<PathBuf, Option<String>>>>,
    holds: bool,
}

/// The last words that were compiled of a shader, and from which texts.
struct Made {
    texts: Texts,
    words: Result<Vec<u32>, String>,
}

impl Kept {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn words(&self, shader: &Shader) -> Result<Option<Vec<u32>>, String> {
        let job = job(shader)?;
        let mut inner = self.lock();
        let held = inner.fit.clone().filter(|_| inner.holds);
        let texts = match held {
            Some(held) => texts(job.file, &|name| {
                let path = self.folder.join(name);
                let text = held.get(&path).cloned().flatten();
                text.ok_or_else(|| format!("{}: it was not there", path.display()))
            }),
            None => texts(job.file, &|name| read(&self.folder, name)),
        };
        if texts.iter().all(|(name, text)| is_own(name, text)) {
            return Ok(None);
        }
        let Inner { compiler, made, .. } = &mut *inner;
        let made = match made.entry((shader.name, shader.build)) {
            Entry::Occupied(entry) if entry.get().texts == texts => entry.into_mut(),
            entry => {
                let words = compile_job(compiler, &job, shader.build, &texts);
                entry.insert_entry(Made { texts, words }).into_mut()
            }
        };
        made.words.clone().map(Some)
    }
}

/// The entry of the table that `shader` was made from.
fn job(shader: &Shader) -> Result<compile::Job, String> {
    let mut jobs = compile::jobs().into_iter();
    jobs.find(|job| job.name() == shader.name)
        .ok_or_else(|| format!("{}: no shader of the table", shader.name))
}

fn compile_job(
    compiler: &shaderc::Compiler,
    job: &compile::Job,
    build: ShaderBuild,
    texts: &Texts,
) -> Result<Vec<u32>, String> {
    let [plain, counting, floor] = compile::BUILDS;
    let build = match build {
        ShaderBuild::Plain => plain,
        ShaderBuild::Counting => counting,
        ShaderBuild::Floor => floor,
    };
    let read = |name: &str| {
        let missing = || Err(format!("{name}, which no line names in quotes"));
        texts.get(name).cloned().unwrap_or_else(missing)
    };
    let bytes = compile::compile(compiler, job, build, &read)?;
    let (words, _) = bytes.as_chunks::<4>();
    Ok(words.iter().map(|&word| u32::from_le_bytes(word)).collect())
}

/// The text of `name` in `folder`.
fn read(folder: &Path, name: &str) -> Result<String, String> {
    let path = folder.join(name);
    fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))
}

/// The text of `file`, which `read` reads, and of all that it includes, taken or not.
fn texts(file: &str, read: &dyn Fn(&str) -> Result<String, String>) -> Texts {
    let mut texts = Texts::new();
    let mut open = vec![file.to_owned()];
    while let Some(name) = open.pop() {
        if texts.contains_key(&name) {
            continue;
        }
        let text = read(&name);
        if let Ok(text) = &text {
            let includes = text.lines().filter_map(included);
            open.extend(includes.map(str::to_owned));
        }
        texts.insert(name, text);
    }
    texts
}

/// The file that a line includes.
fn included(line: &str) -> Option<&str> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start();
    rest.strip_prefix("include")?.split('"').nth(1)
}

/// Whether the text of a file is that which the program was built from.
fn is_own(name: &str, text: &Result<String, String>) -> bool {
    let mut own = shaders::SOURCES.iter();
    own.any(|&(own, of)| own == name && text.as_deref() == Ok(of))
}
