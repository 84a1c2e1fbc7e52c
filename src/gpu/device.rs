//! Device choice, the logical device, names and labels.

use std::ffi::{CStr, CString};
use std::fmt;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use ash::{ext, vk};
use gpu_allocator::vulkan as allocator;

use super::kept::Keeper;
use super::{Error, Instance, Result, ShaderSource, check, lock};

/// A physical device, and what it offers of what is needed.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub(crate) physical: vk::PhysicalDevice,
    pub(crate) queue_family: u32,
    /// Place in the loader's list.
    pub index: usize,
    /// The device's name.
    pub name: String,
    /// Discrete, integrated, virtual or CPU.
    pub kind: vk::PhysicalDeviceType,
    /// The driver's name and version.
    pub driver: String,
    /// Vulkan version, as "major.minor.patch".
    pub api: String,
    /// Size of the largest device-local heap, bytes.
    pub memory: u64,
    /// Bits of a timestamp that count; 0 where its queue cannot stamp the time.
    pub timestamp_bits: u32,
    /// Limits the frame must respect.
    pub limits: vk::PhysicalDeviceLimits,
    /// Whether R16G16_SNORM can be a colour attachment (else R16G16_SFLOAT is used).
    pub snorm_normals: bool,
    /// Whether 32-bit floats can be filtered, by a bilinear tap or a blit.
    pub linear_floats: bool,
    /// Whether RGBA32F images can be blitted from and to.
    pub blit_float32: bool,
    /// Whether fragment shaders can store, which only the counting build wants.
    pub fragment_stores: bool,
    /// Whether invocations of shaders can be counted.
    pub statistics: bool,
    /// Whether it can show pictures in a window, if the window agrees.
    pub swapchain: bool,
    /// What is required and missing; empty when the device can be used.
    pub lacks: Vec<String>,
}

impl Candidate {
    /// Lists the devices in the loader's order.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where there is none.
    pub fn list(instance: &Instance) -> Result<Vec<Self>> {
        // SAFETY: the instance is alive.
        let devices = check("vkEnumeratePhysicalDevices", unsafe {
            instance.raw.enumerate_physical_devices()
        })
        .unwrap_or_default();
        if devices.is_empty() {
            return Err(Error::NoDevice(
                "no Vulkan device: install a driver, on Debian or Ubuntu with `apt install \
                 mesa-vulkan-drivers` (it holds lavapipe, which needs no GPU)"
                    .to_owned(),
            ));
        }
        Ok(devices
            .into_iter()
            .enumerate()
            .map(|(i, d)| Self::query(instance, i, d))
            .collect())
    }

    /// Chooses by name part or index, else the most capable usable device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where nothing matches or what matches cannot be used.
    pub fn choose(list: &[Self], wanted: Option<&str>) -> Result<Self> {
        let names = || {
            list.iter()
                .map(|c| format!("{} ({})", c.index, c.name))
                .collect::<Vec<_>>()
                .join(", ")
        };
        if let Some(wanted) = wanted {
            let lower = wanted.to_lowercase();
            let found = match wanted.parse::<usize>() {
                Ok(index) => list.iter().find(|c| c.index == index),
                Err(_) => list.iter().find(|c| c.name.to_lowercase().contains(&lower)),
            };
            let found = found.ok_or_else(|| {
                Error::NoDevice(format!(
                    "no Vulkan device matches \"{wanted}\"; there are: {}; see `marmor devices`",
                    names()
                ))
            })?;
            if !found.lacks.is_empty() {
                return Err(Error::NoDevice(format!(
                    "device {} ({}) lacks {}; choose another with --device",
                    found.index,
                    found.name,
                    found.lacks.join(", ")
                )));
            }
            return Ok(found.clone());
        }
        // Ties go to the first in the loader's order, which is the system's preference.
        list.iter()
            .filter(|c| c.lacks.is_empty())
            .min_by_key(|c| match c.kind {
                vk::PhysicalDeviceType::DISCRETE_GPU => 0,
                vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
                vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
                _ => 3,
            })
            .cloned()
            .ok_or_else(|| {
                Error::NoDevice(format!(
                    "no usable Vulkan device among {}: each lacks something, see `marmor devices`; \
                     lavapipe always works (`apt install mesa-vulkan-drivers`)",
                    names()
                ))
            })
    }

    fn query(instance: &Instance, index: usize, physical: vk::PhysicalDevice) -> Self {
        let raw = &instance.raw;
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default();
        // Structures newer than the device's own version must not be chained.
        // SAFETY: `physical` comes from this instance.
        let api = unsafe { raw.get_physical_device_properties(physical) }.api_version;
        let modern = api >= vk::API_VERSION_1_3;
        if modern {
            properties = properties.push_next(&mut driver);
        }
        // SAFETY: as above; the chain is well-formed.
        unsafe { raw.get_physical_device_properties2(physical, &mut properties) };
        let properties = properties.properties;
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default();
        if modern {
            features = features.push_next(&mut features13);
        }
        // SAFETY: as above.
        unsafe { raw.get_physical_device_features2(physical, &mut features) };
        let features = features.features;
        // SAFETY: as above.
        let queues = unsafe { raw.get_physical_device_queue_family_properties(physical) };
        // SAFETY: as above.
        let memory = unsafe { raw.get_physical_device_memory_properties(physical) };

        let mut lacks = Vec::new();
        if !modern {
            lacks.push("Vulkan 1.3".to_owned());
        } else if features13.synchronization2 == vk::FALSE {
            lacks.push("synchronization2".to_owned());
        }
        let both = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let queue_family = queues.iter().position(|q| q.queue_flags.contains(both));
        if queue_family.is_none() {
            lacks.push("a queue for both graphics and compute".to_owned());
        }
        let offers = |format, needed| {
            // SAFETY: `physical` comes from this instance.
            let p = unsafe { raw.get_physical_device_format_properties(physical, format) };
            p.optimal_tiling_features.contains(needed)
        };
        use vk::FormatFeatureFlags as F;
        for (format, needed, text) in [
            (
                vk::Format::R32G32B32A32_SFLOAT,
                F::COLOR_ATTACHMENT | F::SAMPLED_IMAGE | F::STORAGE_IMAGE | F::TRANSFER_SRC,
                "RGBA32F as attachment and storage image",
            ),
            (
                vk::Format::D32_SFLOAT,
                F::DEPTH_STENCIL_ATTACHMENT | F::SAMPLED_IMAGE | F::TRANSFER_SRC,
                "D32 as sampled depth attachment",
            ),
            (
                vk::Format::R8G8B8A8_UNORM,
                F::COLOR_ATTACHMENT | F::TRANSFER_SRC,
                "RGBA8 as attachment",
            ),
            (
                vk::Format::R32G32_SFLOAT,
                F::SAMPLED_IMAGE,
                "RG32F textures",
            ),
        ] {
            if !offers(format, needed) {
                lacks.push(text.to_owned());
            }
        }
        let text = |c: std::result::Result<&CStr, _>| {
            c.map_or_else(
                |_: std::ffi::FromBytesUntilNulError| String::new(),
                |c| c.to_string_lossy().into_owned(),
            )
        };
        Candidate {
            physical,
            queue_family: queue_family.unwrap_or(0) as u32,
            index,
            name: text(properties.device_name_as_c_str()),
            kind: properties.device_type,
            driver: format!(
                "{} {}",
                text(driver.driver_name_as_c_str()),
                text(driver.driver_info_as_c_str())
            )
            .trim()
            .to_owned(),
            api: format!(
                "{}.{}.{}",
                vk::api_version_major(api),
                vk::api_version_minor(api),
                vk::api_version_patch(api)
            ),
            memory: memory
                .memory_heaps_as_slice()
                .iter()
                .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
                .map(|h| h.size)
                .max()
                .unwrap_or(0),
            timestamp_bits: queue_family.map_or(0, |i| queues[i].timestamp_valid_bits),
            limits: properties.limits,
            snorm_normals: offers(
                vk::Format::R16G16_SNORM,
                F::COLOR_ATTACHMENT | F::SAMPLED_IMAGE | F::TRANSFER_SRC,
            ),
            linear_floats: [vk::Format::R32G32B32A32_SFLOAT, vk::Format::R32_SFLOAT]
                .iter()
                .all(|&format| offers(format, F::SAMPLED_IMAGE_FILTER_LINEAR)),
            statistics: features.pipeline_statistics_query == vk::TRUE,
            fragment_stores: features.fragment_stores_and_atomics == vk::TRUE,
            swapchain: offered_extensions(instance, physical)
                .is_ok_and(|names| names.iter().any(|name| name == ash::khr::swapchain::NAME)),
            blit_float32: offers(vk::Format::R32G32B32A32_SFLOAT, F::BLIT_SRC | F::BLIT_DST),
            lacks,
        }
    }
}

/// The device extensions that `physical` offers.
fn offered_extensions(instance: &Instance, physical: vk::PhysicalDevice) -> Result<Vec<CString>> {
    // SAFETY: the device comes from this instance.
    let offered = check("vkEnumerateDeviceExtensionProperties", unsafe {
        instance.raw.enumerate_device_extension_properties(physical)
    })?;
    let names = offered
        .iter()
        .filter_map(|e| e.extension_name_as_c_str().ok());
    Ok(names.map(CStr::to_owned).collect())
}

/// A logical device with one queue for graphics, compute and transfer, and the
/// allocator of its memory. Shared by everything made from it.
pub struct Device {
    pub(crate) raw: ash::Device,
    // Vulkan wants one user of a queue at a time.
    pub(crate) queue: Mutex<vk::Queue>,
    pub(crate) queue_family: u32,
    // Dropped by hand in `drop`: it must free its blocks before the device goes.
    pub(crate) allocator: ManuallyDrop<Mutex<allocator::Allocator>>,
    debug: Option<ext::debug_utils::Device>,
    candidate: Candidate,
    made: Made,
    pub(super) pipelines: Keeper,
    shader_source: Mutex<Option<Arc<ShaderSource>>>,
    instance: Arc<Instance>,
}

/// How much was ever made on a device: what a frame loop must leave as it is.
#[derive(Debug, Default)]
pub(crate) struct Made {
    pub allocations: AtomicU64,
    pub pipelines: AtomicU64,
}

/// What was made on a device, and what of it is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Pieces of memory that were ever allocated.
    pub allocations: u64,
    /// Pipelines that were ever made.
    pub pipelines: u64,
    /// Those of them that are kept.
    pub kept: usize,
    /// Those that are kept and nobody uses.
    pub spare: usize,
}

impl fmt::Display for Tally {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Tally {
            pipelines,
            kept,
            spare,
            ..
        } = *self;
        let gone = pipelines.saturating_sub(kept as u64);
        write!(
            to,
            "{pipelines} pipelines made, {gone} destroyed, {kept} kept, {spare} of them spare"
        )
    }
}

impl Device {
    /// Opens `candidate`.
    ///
    /// # Errors
    /// [`Error::Vulkan`] or [`Error::OutOfMemory`] as the driver says.
    pub fn new(instance: &Arc<Instance>, candidate: &Candidate) -> Result<Arc<Self>> {
        let priorities = [1.0];
        let queue = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(candidate.queue_family)
            .queue_priorities(&priorities)];
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default().synchronization2(true);
        // A layered implementation says so by this extension, and then wants it enabled.
        let subset = ash::khr::portability_subset::NAME;
        let offered = offered_extensions(instance, candidate.physical)?;
        let mut extensions = Vec::new();
        if offered.iter().any(|name| name.as_c_str() == subset) {
            extensions.push(subset.as_ptr());
        }
        if instance.presents() && candidate.swapchain {
            extensions.push(ash::khr::swapchain::NAME.as_ptr());
        }
        let features = vk::PhysicalDeviceFeatures::default()
            .fragment_stores_and_atomics(candidate.fragment_stores)
            .pipeline_statistics_query(candidate.statistics);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queue)
            .enabled_features(&features)
            .enabled_extension_names(&extensions)
            .push_next(&mut features13);
        // SAFETY: the candidate comes from this instance, and offers what is enabled.
        let raw = check("vkCreateDevice", unsafe {
            instance.raw.create_device(candidate.physical, &info, None)
        })?;
        let made = allocator::Allocator::new(&allocator::AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: candidate.physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        });
        let allocator = match made {
            Ok(allocator) => allocator,
            Err(error) => {
                // SAFETY: nothing was made from the device yet.
                unsafe { raw.destroy_device(None) };
                return Err(Error::NoDevice(format!(
                    "the memory allocator cannot start: {error}"
                )));
            }
        };
        // SAFETY: the family and index were requested above.
        let queue = unsafe { raw.get_device_queue(candidate.queue_family, 0) };
        let debug = instance
            .debug_utils
            .then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        let device = Arc::new(Device {
            queue: Mutex::new(queue),
            queue_family: candidate.queue_family,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            debug,
            candidate: candidate.clone(),
            made: Made::default(),
            pipelines: Keeper::default(),
            shader_source: Mutex::default(),
            instance: Arc::clone(instance),
            raw,
        });
        device.name(queue, "queue");
        Ok(device)
    }

    /// Counts of what was made so far.
    pub(crate) fn made(&self) -> &Made {
        &self.made
    }

    /// What was made so far, and what of it is kept.
    pub fn tally(&self) -> Tally {
        let [kept, spare] = self.pipelines.count();
        Tally {
            allocations: self.made.allocations.load(Ordering::Relaxed),
            pipelines: self.made.pipelines.load(Ordering::Relaxed),
            kept,
            spare,
        }
    }

    /// Bytes of device memory that buffers and images hold now.
    pub fn bytes_in_use(&self) -> u64 {
        let report = lock(&self.allocator).generate_report();
        report.total_allocated_bytes
    }

    /// Bytes of device memory that were asked of the driver, in use or not.
    pub fn bytes_held(&self) -> u64 {
        lock(&self.allocator).generate_report().total_capacity_bytes
    }

    /// Sets where the pipelines that are made from here on take their shaders from; none for those of the program.
    pub fn set_shader_source(&self, source: Option<Arc<ShaderSource>>) {
        *lock(&self.shader_source) = source;
    }

    pub(crate) fn shader_source(&self) -> Option<Arc<ShaderSource>> {
        lock(&self.shader_source).clone()
    }

    /// What was queried of the device before it was opened.
    pub fn candidate(&self) -> &Candidate {
        &self.candidate
    }

    /// The instance it belongs to.
    pub fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }

    /// Gives `object` a name that debuggers and validation show.
    pub(crate) fn name<T: vk::Handle>(&self, object: T, name: &str) {
        let (Some(debug), Ok(name)) = (&self.debug, CString::new(name)) else {
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(object)
            .object_name(&name);
        // SAFETY: the handle belongs to this device and is not used elsewhere meanwhile.
        // A name that cannot be set costs nothing but the name.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    /// Opens a labelled region in `commands`, shown by RenderDoc and Nsight.
    pub(crate) fn begin_label(&self, commands: vk::CommandBuffer, name: &CStr) {
        let Some(debug) = &self.debug else { return };
        let label = vk::DebugUtilsLabelEXT::default().label_name(name);
        // SAFETY: `commands` is being recorded.
        unsafe { debug.cmd_begin_debug_utils_label(commands, &label) };
    }

    /// Closes the innermost labelled region.
    pub(crate) fn end_label(&self, commands: vk::CommandBuffer) {
        let Some(debug) = &self.debug else { return };
        // SAFETY: `commands` is being recorded and has an open label.
        unsafe { debug.cmd_end_debug_utils_label(commands) };
    }

    /// Puts a label at one point of `commands`.
    pub(crate) fn insert_label(&self, commands: vk::CommandBuffer, name: &CStr) {
        let Some(debug) = &self.debug else { return };
        let label = vk::DebugUtilsLabelEXT::default().label_name(name);
        // SAFETY: `commands` is being recorded.
        unsafe { debug.cmd_insert_debug_utils_label(commands, &label) };
    }

    /// Waits until the queue is idle. For teardown and one-off transfers, never in a frame loop.
    pub(crate) fn wait_for_queue(&self) -> Result<()> {
        let queue = lock(&self.queue);
        // SAFETY: the queue belongs to this device, and the lock is held.
        check("vkQueueWaitIdle", unsafe {
            self.raw.queue_wait_idle(*queue)
        })
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.pipelines.clear(&self.raw);
        // SAFETY: whatever was made from the device holds a share of it, so all of it is
        // gone; the allocator goes first, since it frees device memory.
        unsafe {
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
        }
    }
}
