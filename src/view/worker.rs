//! What takes too long for a frame of the window: a thread with work of its own on the same device.
//!
//! It does one job at a time, and the newest wins: whoever asks anew stops what runs. What it has to say comes through a
//! channel, and wakes the window.

use super::Error;
use super::region::{self, Fault, Region};
use crate::frame::probe::{FetchCost, Probe};
use crate::frame::{self, Options};
use crate::gpu::{self, Device};
use crate::ledger::Ledger;
use crate::scene::Plan;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, TryRecvError};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Rounds that fetches are timed in, after one that warms up.
const ROUNDS: u32 = 5;
/// Between them, so that the window has its frames.
const PAUSE: Duration = Duration::from_millis(50);

/// What there is to do.
#[derive(Clone, Debug)]
pub enum Job {
    /// Count what each pixel of the plan reads; of a split picture by the method on the right.
    Fetches(Box<Plan>),
    /// Measure the error against exact.
    Error {
        /// The picture.
        plan: Box<Plan>,
        /// Columns and rows of it: x, y, width, height.
        place: [u32; 4],
        /// Frames that the still averages.
        frames: u32,
    },
    /// Time each kind of fetch.
    Prices,
}

/// What each pixel of a picture has read.
#[derive(Clone, Debug)]
pub struct Fetches {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// The method.
    pub method: String,
    /// The three accounts.
    pub ledger: Ledger,
}

/// What the worker says.
#[derive(Debug)]
pub enum Report {
    /// The share of the job that is done.
    Progress(f32),
    /// Fetches of a picture.
    Fetches(Fetches),
    /// The error of a region.
    Error(Region),
    /// What each kind of fetch costs.
    Prices(Vec<FetchCost>),
    /// The job has failed; one line.
    Failed(String),
    /// The job was stopped.
    Stopped,
}

impl Report {
    fn is_last(&self) -> bool {
        !matches!(self, Report::Progress(_))
    }
}

/// A job, by the number of the asking, and what stops it.
struct Asked {
    number: u64,
    job: Job,
    stop: Arc<AtomicBool>,
}

#[derive(Default)]
struct Desk {
    asked: Option<Asked>,
    ends: bool,
}

type Shared = Arc<(Mutex<Desk>, Condvar)>;

/// The thread, seen from the window. When it goes, it stops what runs and waits for the thread.
pub struct Worker {
    shared: Shared,
    thread: Option<JoinHandle<()>>,
    reports: Receiver<(u64, Report)>,
    // The last job that was asked for, until it is done: for which picture, and what stops it.
    doing: Option<(u64, Arc<AtomicBool>)>,
    number: u64,
}

impl Worker {
    /// Starts a thread that works on `device`, and calls `wake` whenever it has something to say.
    ///
    /// # Errors
    /// [`Error::Start`] where the system gives no thread.
    pub fn new(
        options: &Options,
        device: &Arc<Device>,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Worker, Error> {
        let shared = Shared::default();
        let (sender, reports) = mpsc::channel();
        let bench = Bench {
            options: options.clone(),
            device: Arc::clone(device),
            sender,
            wake: Box::new(wake),
        };
        let theirs = Arc::clone(&shared);
        let thread = thread::Builder::new().name("worker".to_owned());
        let thread = thread
            .spawn(move || bench.work(&theirs))
            .map_err(|error| Error::Start(format!("the system gives no thread ({error})")))?;
        Ok(Worker {
            shared,
            thread: Some(thread),
            reports,
            doing: None,
            number: 0,
        })
    }

    /// Has `job` done next, in place of what runs.
    pub fn ask(&mut self, job: Job) {
        self.cancel();
        self.number += 1;
        let stop = Arc::new(AtomicBool::new(false));
        self.doing = Some((self.number, Arc::clone(&stop)));
        let number = self.number;
        gpu::lock(&self.shared.0).asked = Some(Asked { number, job, stop });
        self.shared.1.notify_one();
    }

    /// Stops what runs; nothing more is heard of it.
    pub fn cancel(&mut self) {
        if let Some((_, stop)) = self.doing.take() {
            stop.store(true, Ordering::Relaxed);
        }
        gpu::lock(&self.shared.0).asked = None;
    }

    /// Whether a job runs.
    pub fn is_busy(&self) -> bool {
        self.doing.is_some()
    }

    /// What is new of the job that was asked for last.
    pub fn reports(&mut self) -> Vec<Report> {
        let mut news = Vec::new();
        loop {
            match self.reports.try_recv() {
                Ok((number, report)) => {
                    let own = self.doing.as_ref().is_some_and(|(own, _)| *own == number);
                    if own {
                        if report.is_last() {
                            self.doing = None;
                        }
                        news.push(report);
                    }
                }
                Err(TryRecvError::Empty) => return news,
                Err(TryRecvError::Disconnected) => {
                    if self.doing.take().is_some() {
                        news.push(Report::Failed("the measuring thread has ended".to_owned()));
                    }
                    return news;
                }
            }
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.cancel();
        gpu::lock(&self.shared.0).ends = true;
        self.shared.1.notify_one();
        if let Some(thread) = self.thread.take() {
            // It has failed, or it has ended: there is nothing left to say it to.
            let _ = thread.join();
        }
    }
}

/// The thread's own.
struct Bench {
    options: Options,
    device: Arc<Device>,
    sender: Sender<(u64, Report)>,
    wake: Box<dyn Fn() + Send>,
}

impl Bench {
    fn work(&self, shared: &Shared) {
        let (desk, bell) = (&shared.0, &shared.1);
        loop {
            let asked = {
                let mut desk = gpu::lock(desk);
                loop {
                    if desk.ends {
                        return;
                    }
                    if let Some(asked) = desk.asked.take() {
                        break asked;
                    }
                    desk = bell
                        .wait(desk)
                        .unwrap_or_else(|poisoned| poisoned.into_inner());
                }
            };
            let report = match self.does(&asked) {
                Ok(report) => report,
                Err(Fault::Stopped) => Report::Stopped,
                Err(Fault::Failed(message)) => Report::Failed(message),
            };
            self.say(asked.number, report);
        }
    }

    fn say(&self, number: u64, report: Report) {
        // Without a window there is no one to tell.
        let _ = self.sender.send((number, report));
        (self.wake)();
    }

    fn does(&self, asked: &Asked) -> Result<Report, Fault> {
        let stops = || match asked.stop.load(Ordering::Relaxed) {
            true => Err(Fault::Stopped),
            false => Ok(()),
        };
        match &asked.job {
            Job::Fetches(plan) => {
                let mut plan = (**plan).clone();
                plan.split = None;
                frame::check_fit(&self.options, &plan, self.device.candidate(), false)?;
                let ledger = frame::count_on(&self.device, &plan, &mut |_| ())?;
                Ok(Report::Fetches(Fetches {
                    size: plan.size,
                    method: plan.method_name(),
                    ledger,
                }))
            }
            Job::Error {
                plan,
                place,
                frames,
            } => {
                let on = (&self.options, &self.device);
                let mut progress = |share| self.say(asked.number, Report::Progress(share));
                let region =
                    region::measure(on, plan, *place, *frames, &asked.stop, &mut progress)?;
                Ok(Report::Error(region))
            }
            Job::Prices => {
                let filter = frame::filter_of(self.device.candidate());
                let mut probe = Probe::new(&self.device, filter)?;
                for round in 0..=ROUNDS {
                    stops()?;
                    probe.round(round > 0)?;
                    thread::sleep(PAUSE);
                }
                Ok(Report::Prices(probe.costs()))
            }
        }
    }
}
