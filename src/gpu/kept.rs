//! Pipelines that are kept: whoever asks for one that was made before gets that one.
//!
//! A window that is resized, or goes back to another method, makes its renderer anew. What takes long of that is the
//! driver's compiling, some drivers' when a pipeline is made and others' when it first draws. Neither happens twice, since
//! no pipeline here depends on the size of what it draws into.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex};

use ash::vk;

use super::lock;

/// How many pipelines that nobody uses are kept? A renderer makes six, and another method one or two more: this is room for
/// all methods in turn. lavapipe keeps 10 MiB for each that shades.
const SPARE: usize = 16;

/// A pipeline and its layout, shared by all that asked for the same.
pub(crate) struct Kept {
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    key: u64,
}

/// The pipelines of a device.
#[derive(Default)]
pub(crate) struct Keeper {
    // Those first that were asked for least recently.
    all: Mutex<Vec<Arc<Kept>>>,
}

/// Stands for `all` that a pipeline is made of: its SPIR-V and constants, its state, the layout of its sets, and the render
/// pass as far as that must be compatible. Of 64 bits, so that two different ones are never met in practice.
pub(crate) fn key(all: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    all.hash(&mut hasher);
    hasher.finish()
}

impl Keeper {
    /// The pipeline of `key`, if there is one.
    pub fn find(&self, key: u64) -> Option<Arc<Kept>> {
        let mut all = lock(&self.all);
        let place = all.iter().position(|kept| kept.key == key)?;
        let kept = all.remove(place);
        all.push(Arc::clone(&kept));
        Some(kept)
    }

    /// Keeps what was made, and lets the oldest go of those that nobody uses, if they are too many.
    pub fn keep(
        &self,
        device: &ash::Device,
        key: u64,
        raw: vk::Pipeline,
        layout: vk::PipelineLayout,
    ) -> Arc<Kept> {
        let kept = Arc::new(Kept { raw, layout, key });
        let mut all = lock(&self.all);
        all.push(Arc::clone(&kept));
        for surplus in surplus(&mut all) {
            destroy(device, &surplus);
        }
        kept
    }

    /// How many are kept, and how many of those nobody uses.
    pub fn count(&self) -> [usize; 2] {
        let all = lock(&self.all);
        [all.len(), all.iter().filter(|kept| unused(kept)).count()]
    }

    /// Lets all go, before the device does.
    pub fn clear(&mut self, device: &ash::Device) {
        for kept in lock(&self.all).drain(..) {
            destroy(device, &kept);
        }
    }
}

/// Whether nobody uses it; while the list is locked no share is handed out, so that what is unused stays so.
fn unused(kept: &Arc<Kept>) -> bool {
    Arc::strong_count(kept) == 1
}

/// Takes the oldest out of `all` that nobody uses, if those are too many.
fn surplus(all: &mut Vec<Arc<Kept>>) -> Vec<Arc<Kept>> {
    let count = all.iter().filter(|kept| unused(kept)).count();
    let mut beyond = count.saturating_sub(SPARE);
    let goes = |kept: &mut Arc<Kept>| {
        let goes = beyond > 0 && unused(kept);
        beyond -= usize::from(goes);
        goes
    };
    all.extract_if(.., goes).collect()
}

/// Destroys what nobody uses any more.
fn destroy(device: &ash::Device, kept: &Kept) {
    // SAFETY: all owners have dropped their shares, and each waited for the device's last use before it did.
    unsafe {
        device.destroy_pipeline(kept.raw, None);
        device.destroy_pipeline_layout(kept.layout, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pipelines(keys: std::ops::Range<u64>) -> Vec<Arc<Kept>> {
        let kept = |key| Kept {
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            key,
        };
        keys.map(|key| Arc::new(kept(key))).collect()
    }

    fn keys(all: &[Arc<Kept>]) -> Vec<u64> {
        all.iter().map(|kept| kept.key).collect()
    }

    #[test]
    fn the_oldest_go_that_nobody_uses() {
        let spare = SPARE as u64;
        let mut all = pipelines(0..spare);
        assert!(surplus(&mut all).is_empty());
        all.extend(pipelines(spare..spare + 3));
        let used = [Arc::clone(&all[0]), Arc::clone(&all[5])];
        // One of three may stay for each that is used.
        assert_eq!(keys(&surplus(&mut all)), [1]);
        drop(used);
        assert_eq!(keys(&surplus(&mut all)), [0, 2]);
        assert_eq!(keys(&all), (3..spare + 3).collect::<Vec<_>>());
    }

    #[test]
    fn what_is_asked_for_becomes_the_youngest() {
        let keeper = Keeper {
            all: Mutex::new(pipelines(0..4)),
        };
        assert!(keeper.find(9).is_none());
        let found = keeper.find(1).expect("one that is kept");
        assert_eq!(keys(&lock(&keeper.all)), [0, 2, 3, 1]);
        assert_eq!(Arc::strong_count(&found), 2);
    }
}
