//! A window's surface, and the swapchain that shows pictures on it.

use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use super::{Candidate, Device, Error, Image, ImageDesc, Instance, Result, check, lock};

/// What a window offers to draw on. The window must outlive it.
pub struct Surface {
    raw: vk::SurfaceKHR,
    functions: khr::surface::Instance,
    instance: Arc<Instance>,
}

/// Display and window, as the system knows them.
pub type Handles = (RawDisplayHandle, RawWindowHandle);

impl Surface {
    /// Makes the surface of a window. Whoever owns the window keeps it until the surface is gone.
    ///
    /// # Errors
    /// [`Error::NoDevice`] of an instance that was not made for windows, or what the driver says.
    pub fn new(instance: &Arc<Instance>, (display, window): Handles) -> Result<Self> {
        if !instance.presents() {
            return Err(Error::NoDevice(
                "this Vulkan instance was not made for windows".to_owned(),
            ));
        }
        // SAFETY: the handles are of a window that outlives the surface, as the caller promises, and the instance has the
        // extensions of its display.
        let raw = check("vkCreateSurfaceKHR", unsafe {
            ash_window::create_surface(&instance.entry, &instance.raw, display, window, None)
        })?;
        Ok(Surface {
            raw,
            functions: khr::surface::Instance::new(&instance.entry, &instance.raw),
            instance: Arc::clone(instance),
        })
    }

    /// Strikes out those of `list` that cannot show pictures on it.
    ///
    /// # Errors
    /// What the driver says.
    pub fn strike_out(&self, list: &mut [Candidate]) -> Result<()> {
        for candidate in list {
            // SAFETY: candidate and surface are of one instance.
            let shows = check("vkGetPhysicalDeviceSurfaceSupportKHR", unsafe {
                self.functions.get_physical_device_surface_support(
                    candidate.physical,
                    candidate.queue_family,
                    self.raw,
                )
            })?;
            if !shows || !candidate.swapchain {
                candidate
                    .lacks
                    .push("a swapchain for this window".to_owned());
            }
        }
        Ok(())
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: swapchains hold a share of the surface, so none is left.
        unsafe { self.functions.destroy_surface(self.raw, None) };
        let _ = &self.instance;
    }
}

/// When a picture that is ready may be shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PresentMode {
    /// With the display's next refresh, in turn: no tearing, and every system has it.
    #[default]
    Fifo,
    /// With the next refresh, the newest first: no tearing, less delay, frames in vain.
    Mailbox,
    /// At once: it tears.
    Immediate,
}

impl PresentMode {
    /// The names by which the modes are asked for.
    pub const NAMES: [&'static str; 3] = ["fifo", "mailbox", "immediate"];

    /// Its name.
    pub fn name(self) -> &'static str {
        PresentMode::NAMES[self as usize]
    }

    fn raw(self) -> vk::PresentModeKHR {
        match self {
            PresentMode::Fifo => vk::PresentModeKHR::FIFO,
            PresentMode::Mailbox => vk::PresentModeKHR::MAILBOX,
            PresentMode::Immediate => vk::PresentModeKHR::IMMEDIATE,
        }
    }
}

/// The images of a window, shown in turn.
pub struct Swapchain {
    raw: vk::SwapchainKHR,
    images: Vec<Image>,
    // One for each image: the presentation engine may still wait for it when the frame's fence has long signalled.
    finished: Vec<Semaphore>,
    mode: PresentMode,
    functions: khr::swapchain::Device,
    surface: Arc<Surface>,
    device: Arc<Device>,
}

/// What became of the wish for an image, or of the wish to show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn<T> {
    /// It was granted.
    Granted(T),
    /// It was granted, but the window has changed: the next frame wants another swapchain.
    Suboptimal(T),
    /// The window has changed: nothing can be shown before there is another swapchain.
    OutOfDate,
    /// All images are in use; ask again.
    NotYet,
}

/// How long may a frame wait for an image, ns? A window that nobody sees may never get one, and must still close.
const ACQUIRE_TIMEOUT: u64 = 250_000_000;

impl Swapchain {
    /// Makes the images of a window of about `size` pixels, in place of `old`; none while the window has no area, as
    /// when it is minimised. A `mode` that the window lacks becomes FIFO, which each has.
    ///
    /// Waits until the queue is idle if there is an old one: its images may still be shown.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the window has no format that we can draw, or what the driver says.
    pub fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        size: [u32; 2],
        mode: PresentMode,
        old: Option<Swapchain>,
    ) -> Result<Option<Self>> {
        let physical = device.candidate().physical;
        let query = &surface.functions;
        // SAFETY: device and surface are of one instance and alive.
        let ability = check("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", unsafe {
            query.get_physical_device_surface_capabilities(physical, surface.raw)
        })?;
        // SAFETY: as above.
        let formats = check("vkGetPhysicalDeviceSurfaceFormatsKHR", unsafe {
            query.get_physical_device_surface_formats(physical, surface.raw)
        })?;
        // SAFETY: as above.
        let modes = check("vkGetPhysicalDeviceSurfacePresentModesKHR", unsafe {
            query.get_physical_device_surface_present_modes(physical, surface.raw)
        })?;
        let extent = extent(&ability, size);
        if extent.contains(&0) {
            return Ok(None);
        }
        let format = choose_format(&formats).ok_or_else(|| {
            Error::Unsupported(
                "the window has neither BGRA8 nor RGBA8 in sRGB; choose another --device"
                    .to_owned(),
            )
        })?;
        let mode = match modes.contains(&mode.raw()) {
            true => mode,
            false => PresentMode::Fifo,
        };
        // One more than the least, so that a frame need not wait for the display to let go of one.
        let most = match ability.max_image_count {
            0 => u32::MAX,
            most => most,
        };
        let alpha = [
            vk::CompositeAlphaFlagsKHR::OPAQUE,
            vk::CompositeAlphaFlagsKHR::INHERIT,
            vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
            vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED,
        ];
        let alpha = alpha
            .into_iter()
            .find(|&a| ability.supported_composite_alpha.contains(a));
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count((ability.min_image_count + 1).min(most))
            .image_format(format.format)
            .image_color_space(format.color_space)
            .image_extent(vk::Extent2D {
                width: extent[0],
                height: extent[1],
            })
            .image_array_layers(1)
            // Drawn to only: an sRGB format has no storage.
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(ability.current_transform)
            .composite_alpha(alpha.unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE))
            .present_mode(mode.raw())
            .clipped(true)
            .old_swapchain(
                old.as_ref()
                    .map_or_else(vk::SwapchainKHR::null, |old| old.raw),
            );
        let functions = khr::swapchain::Device::new(&device.instance().raw, &device.raw);
        // SAFETY: the surface offers what `info` asks for; the old swapchain is alive and of the same surface.
        let raw = check("vkCreateSwapchainKHR", unsafe {
            functions.create_swapchain(&info, None)
        });
        drop(old);
        // Owned from here on, so that an early return below leaks nothing.
        let mut made = Swapchain {
            raw: raw?,
            images: Vec::new(),
            finished: Vec::new(),
            mode,
            functions,
            surface: Arc::clone(surface),
            device: Arc::clone(device),
        };
        device.name(made.raw, "swapchain");
        // SAFETY: the swapchain was made above.
        let images = check("vkGetSwapchainImagesKHR", unsafe {
            made.functions.get_swapchain_images(made.raw)
        })?;
        let desc = ImageDesc {
            size: extent,
            format: format.format,
            usage: vk::ImageUsageFlags::COLOR_ATTACHMENT,
        };
        for (k, raw) in images.into_iter().enumerate() {
            made.images.push(Image::borrowed(
                device,
                &format!("swapchain {k}"),
                raw,
                desc,
            )?);
            made.finished
                .push(Semaphore::new(device, &format!("finished {k}"))?);
        }
        Ok(Some(made))
    }

    /// The images, each in its turn.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.images.first().map_or([0; 2], Image::size)
    }

    /// How pictures are shown, which need not be how it was asked for.
    pub fn mode(&self) -> PresentMode {
        self.mode
    }

    /// Asks for the next image, which may be drawn once `acquired` has signalled; its number.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] among others.
    pub fn acquire(&self, acquired: &Semaphore) -> Result<Turn<usize>> {
        // SAFETY: swapchain and semaphore are alive; nothing else waits for the semaphore, since its frame's fence has
        // signalled.
        let turn = unsafe {
            self.functions.acquire_next_image(
                self.raw,
                ACQUIRE_TIMEOUT,
                acquired.raw,
                vk::Fence::null(),
            )
        };
        match turn {
            Ok((image, false)) => Ok(Turn::Granted(image as usize)),
            Ok((image, true)) => Ok(Turn::Suboptimal(image as usize)),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(Turn::OutOfDate),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Turn::NotYet),
            Err(error) => check("vkAcquireNextImageKHR", Err(error)),
        }
    }

    /// The semaphore that says that image `image` is drawn.
    pub fn finished(&self, image: usize) -> &Semaphore {
        &self.finished[image]
    }

    /// Shows image `image` once its [`Swapchain::finished`] has signalled.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] among others.
    pub fn present(&self, image: usize) -> Result<Turn<()>> {
        let (wait, swapchains, images) = ([self.finished[image].raw], [self.raw], [image as u32]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&wait)
            .swapchains(&swapchains)
            .image_indices(&images);
        let queue = lock(&self.device.queue);
        // SAFETY: the image was acquired, a submit signals the semaphore, and the queue's lock is held.
        match unsafe { self.functions.queue_present(*queue, &info) } {
            Ok(false) => Ok(Turn::Granted(())),
            Ok(true) => Ok(Turn::Suboptimal(())),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => Ok(Turn::OutOfDate),
            Err(error) => check("vkQueuePresentKHR", Err(error)),
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // The last images may still wait to be shown. No fence tells when they were, short of an extension that few drivers
        // have; an idle queue is what everybody makes do with. An error means that the device
        // is lost, and then nothing is pending.
        let _ = self.device.wait_for_queue();
        self.images.clear();
        // SAFETY: the queue is idle, and the views of its images are gone.
        unsafe { self.functions.destroy_swapchain(self.raw, None) };
        let _ = &self.surface;
    }
}

/// The extent that the window wants, or leaves to us.
fn extent(ability: &vk::SurfaceCapabilitiesKHR, wanted: [u32; 2]) -> [u32; 2] {
    let vk::Extent2D { width, height } = ability.current_extent;
    if width != u32::MAX {
        return [width, height];
    }
    let (least, most) = (ability.min_image_extent, ability.max_image_extent);
    if wanted.contains(&0) {
        return [0; 2];
    }
    [
        wanted[0].clamp(least.width, most.width.max(least.width)),
        wanted[1].clamp(least.height, most.height.max(least.height)),
    ]
}

/// The format of the window: one that encodes sRGB as it stores, so that light is mixed as light. Else one of bytes, for
/// which the shaders encode.
fn choose_format(offered: &[vk::SurfaceFormatKHR]) -> Option<vk::SurfaceFormatKHR> {
    let wanted = [
        vk::Format::B8G8R8A8_SRGB,
        vk::Format::R8G8B8A8_SRGB,
        vk::Format::B8G8R8A8_UNORM,
        vk::Format::R8G8B8A8_UNORM,
    ];
    wanted.into_iter().find_map(|format| {
        offered.iter().copied().find(|offer| {
            offer.format == format && offer.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR
        })
    })
}

/// Whether `format` encodes sRGB as it stores.
pub fn encodes(format: vk::Format) -> bool {
    matches!(
        format,
        vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB
    )
}

/// A binary semaphore: orders what two queues do, here ours and that of the display.
pub struct Semaphore {
    pub(crate) raw: vk::Semaphore,
    device: Arc<Device>,
}

impl Semaphore {
    /// Makes a semaphore that nothing has signalled.
    ///
    /// # Errors
    /// What the driver says.
    pub fn new(device: &Arc<Device>, name: &str) -> Result<Self> {
        let info = vk::SemaphoreCreateInfo::default();
        // SAFETY: the device is alive.
        let raw = check("vkCreateSemaphore", unsafe {
            device.raw.create_semaphore(&info, None)
        })?;
        device.name(raw, name);
        Ok(Semaphore {
            raw,
            device: Arc::clone(device),
        })
    }
}

impl Drop for Semaphore {
    fn drop(&mut self) {
        // SAFETY: owners wait for the queue before they drop the semaphore.
        unsafe { self.device.raw.destroy_semaphore(self.raw, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offer(format: vk::Format, color_space: vk::ColorSpaceKHR) -> vk::SurfaceFormatKHR {
        vk::SurfaceFormatKHR {
            format,
            color_space,
        }
    }

    #[test]
    fn a_format_that_encodes_comes_first() {
        let srgb = vk::ColorSpaceKHR::SRGB_NONLINEAR;
        let wide = vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT;
        let bytes = offer(vk::Format::B8G8R8A8_UNORM, srgb);
        let encoding = offer(vk::Format::B8G8R8A8_SRGB, srgb);
        let far = offer(vk::Format::B8G8R8A8_SRGB, wide);
        let deep = offer(vk::Format::A2B10G10R10_UNORM_PACK32, srgb);
        assert_eq!(choose_format(&[deep, bytes, encoding]), Some(encoding));
        assert_eq!(choose_format(&[far, deep, bytes]), Some(bytes));
        assert_eq!(choose_format(&[far, deep]), None);
        assert!(encodes(encoding.format) && !encodes(bytes.format));
    }

    #[test]
    fn the_window_decides_its_extent_if_it_does() {
        let mut ability = vk::SurfaceCapabilitiesKHR {
            current_extent: vk::Extent2D {
                width: 640,
                height: 0,
            },
            min_image_extent: vk::Extent2D {
                width: 1,
                height: 1,
            },
            max_image_extent: vk::Extent2D {
                width: 4096,
                height: 4096,
            },
            ..Default::default()
        };
        assert_eq!(extent(&ability, [9, 9]), [640, 0], "minimised");
        ability.current_extent = vk::Extent2D {
            width: u32::MAX,
            height: u32::MAX,
        };
        assert_eq!(extent(&ability, [9000, 9]), [4096, 9]);
        assert_eq!(extent(&ability, [0, 9]), [0, 0]);
    }

    #[test]
    fn modes_have_their_names() {
        use PresentMode::*;
        assert_eq!(
            [Fifo, Mailbox, Immediate].map(PresentMode::name),
            PresentMode::NAMES
        );
    }
}
