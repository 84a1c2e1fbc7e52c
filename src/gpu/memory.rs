//! Buffers.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ash::vk;
use gpu_allocator::{MemoryLocation, vulkan::*};

use super::{Device, Error, Result, check, lock};

/// Where a buffer lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Location {
    /// Device memory, not visible to the host.
    Device,
    /// Host-visible, written by the host and read by the device.
    Upload,
    /// Host-visible, written by the device and read by the host.
    Readback,
}

impl From<Location> for MemoryLocation {
    fn from(location: Location) -> Self {
        match location {
            Location::Device => MemoryLocation::GpuOnly,
            Location::Upload => MemoryLocation::CpuToGpu,
            Location::Readback => MemoryLocation::GpuToCpu,
        }
    }
}

/// Allocates memory that fits `requirements`.
pub(super) fn allocate(
    device: &Device,
    name: &str,
    requirements: vk::MemoryRequirements,
    location: MemoryLocation,
    linear: bool,
) -> Result<Allocation> {
    device.made().allocations.fetch_add(1, Ordering::Relaxed);
    let mut allocator = lock(&device.allocator);
    allocator
        .allocate(&AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })
        .map_err(|error| {
            tracing::debug!("allocating {name}: {error}");
            Error::OutOfMemory {
                what: name.to_owned(),
                bytes: Some(requirements.size),
            }
        })
}

/// Gives memory back.
pub(super) fn free(device: &Device, allocation: Allocation) {
    let mut allocator = lock(&device.allocator);
    if let Err(error) = allocator.free(allocation) {
        tracing::error!("freeing device memory: {error}");
    }
}

/// A buffer with its memory.
pub struct Buffer {
    pub(crate) raw: vk::Buffer,
    allocation: Option<Allocation>,
    size: u64,
    device: Arc<Device>,
}

impl Buffer {
    /// Makes a buffer of `size` bytes.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] naming the buffer, or what the driver says.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        usage: vk::BufferUsageFlags,
        location: Location,
    ) -> Result<Self> {
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the device is alive; sharing is exclusive on its one queue.
        let raw = check("vkCreateBuffer", unsafe {
            device.raw.create_buffer(&info, None)
        })?;
        // SAFETY: `raw` was made above.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        let mut buffer = Buffer {
            raw,
            allocation: None,
            size,
            device: Arc::clone(device),
        };
        let allocation = allocate(device, name, requirements, location.into(), true)?;
        // SAFETY: the range was allocated for this buffer, which has no memory yet.
        let bound = unsafe {
            device
                .raw
                .bind_buffer_memory(raw, allocation.memory(), allocation.offset())
        };
        buffer.allocation = Some(allocation);
        check("vkBindBufferMemory", bound)?;
        device.name(raw, name);
        Ok(buffer)
    }

    /// Size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Copies `data` to the start of an [`Location::Upload`] buffer.
    ///
    /// The caller has made sure that the device does not read it meanwhile.
    ///
    /// # Errors
    /// [`Error::Vulkan`] where the memory is not host-visible or too small.
    pub fn write(&mut self, data: &[u8]) -> Result<()> {
        self.allocation
            .as_mut()
            .and_then(|a| a.mapped_slice_mut())
            .and_then(|mapped| mapped.get_mut(..data.len()))
            .map(|mapped| mapped.copy_from_slice(data))
            .ok_or(Error::Vulkan {
                call: "vkMapMemory",
                result: vk::Result::ERROR_MEMORY_MAP_FAILED,
            })
    }

    /// The contents of an [`Location::Readback`] buffer, once the device has written it.
    ///
    /// # Errors
    /// [`Error::Vulkan`] where the memory is not host-visible.
    pub fn read(&self) -> Result<&[u8]> {
        self.allocation
            .as_ref()
            .and_then(|a| a.mapped_slice())
            .and_then(|mapped| mapped.get(..self.size as usize))
            .ok_or(Error::Vulkan {
                call: "vkMapMemory",
                result: vk::Result::ERROR_MEMORY_MAP_FAILED,
            })
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device's last use before they drop the buffer.
        unsafe { self.device.raw.destroy_buffer(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            free(&self.device, allocation);
        }
    }
}
