//! The Vulkan instance, with the validation layer when asked.

use std::ffi::{CStr, c_void};
use std::sync::Mutex;

use ash::{ext, vk};
use raw_window_handle::RawDisplayHandle;

use super::{Error, Result, check};

/// The layer that watches, core and synchronisation.
const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// A Vulkan instance and, with validation on, the messages its layer has sent.
pub struct Instance {
    // Declared before `entry`, which must outlive every function pointer taken from it.
    pub(crate) raw: ash::Instance,
    pub(crate) debug_utils: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    // Boxed: the messenger holds its address.
    messages: Box<Mutex<Vec<String>>>,
    validation: bool,
    presents: bool,
    pub(crate) entry: ash::Entry,
}

impl Instance {
    /// Loads Vulkan and makes an instance.
    ///
    /// `validation` switches on the Khronos layer with synchronisation validation.
    /// `loader` names the loader library in place of the system's. With a `display` there may be surfaces of its windows.
    ///
    /// # Errors
    /// [`Error::NoDevice`] without a loader, without Vulkan 1.3, without the layer that was asked for, or where Vulkan
    /// cannot draw on that display.
    pub fn new(
        validation: bool,
        loader: Option<&str>,
        display: Option<RawDisplayHandle>,
    ) -> Result<Self> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers, which
        // the loader's contract makes safe at any time.
        let entry = unsafe {
            match loader {
                Some(path) => ash::Entry::load_from(path),
                None => ash::Entry::load(),
            }
        }
        .map_err(|error| {
            Error::NoDevice(format!(
                "no Vulkan loader ({error}): install it, on Debian or Ubuntu with `apt install \
                 libvulkan1 mesa-vulkan-drivers`"
            ))
        })?;

        // SAFETY: entry is a loaded loader.
        let version = check("vkEnumerateInstanceVersion", unsafe {
            entry.try_enumerate_instance_version()
        })?
        .unwrap_or(vk::API_VERSION_1_0);
        if version < vk::API_VERSION_1_3 {
            return Err(Error::NoDevice(format!(
                "the Vulkan loader offers {}.{}, marmor needs 1.3: update libvulkan1",
                vk::api_version_major(version),
                vk::api_version_minor(version)
            )));
        }

        // SAFETY: entry is a loaded loader.
        let layers = check("vkEnumerateInstanceLayerProperties", unsafe {
            entry.enumerate_instance_layer_properties()
        })?;
        let has_layer = layers
            .iter()
            .any(|l| l.layer_name_as_c_str().is_ok_and(|n| n == VALIDATION_LAYER));
        if validation && !has_layer {
            return Err(Error::NoDevice(
                "validation was asked for, but VK_LAYER_KHRONOS_validation is not installed: on \
                 Debian or Ubuntu `apt install vulkan-validationlayers`, or run without --validation"
                    .to_owned(),
            ));
        }
        // SAFETY: entry is a loaded loader.
        let extensions = check("vkEnumerateInstanceExtensionProperties", unsafe {
            entry.enumerate_instance_extension_properties(None)
        })?;
        let has = |name: &CStr| {
            extensions
                .iter()
                .any(|e| e.extension_name_as_c_str().is_ok_and(|n| n == name))
        };
        let debug_utils = has(ext::debug_utils::NAME) || validation;
        let portability = has(ash::khr::portability_enumeration::NAME);

        let application = vk::ApplicationInfo::default()
            .application_name(c"marmor")
            .engine_name(c"marmor")
            .api_version(vk::API_VERSION_1_3);
        let mut extension_names = Vec::new();
        if debug_utils {
            extension_names.push(ext::debug_utils::NAME.as_ptr());
        }
        if let Some(display) = display {
            let wanted = ash_window::enumerate_required_extensions(display)
                .map_err(|_| Error::NoDevice("Vulkan knows no such display".to_owned()))?;
            for &name in wanted {
                // SAFETY: the names are literals that end in 0.
                let text = unsafe { CStr::from_ptr(name) };
                if !has(text) {
                    return Err(Error::NoDevice(format!(
                        "Vulkan has no {} to draw in a window with: install a driver, on Debian or Ubuntu with `apt \
                         install mesa-vulkan-drivers`",
                        text.to_string_lossy()
                    )));
                }
                extension_names.push(name);
            }
        }
        let mut flags = vk::InstanceCreateFlags::empty();
        if portability {
            extension_names.push(ash::khr::portability_enumeration::NAME.as_ptr());
            flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }
        let layer_names: &[_] = if validation {
            &[VALIDATION_LAYER.as_ptr()]
        } else {
            &[]
        };

        let messages = Box::new(Mutex::new(Vec::new()));
        let mut messenger_info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                    | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(on_message))
            .user_data((&raw const *messages).cast_mut().cast());
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .flags(flags)
            .enabled_layer_names(layer_names)
            .enabled_extension_names(&extension_names);
        if validation {
            info = info.push_next(&mut features).push_next(&mut messenger_info);
        }

        // SAFETY: every pointer in `info` outlives the call; layers and extensions were found above.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| {
            Error::NoDevice(format!(
                "Vulkan cannot make an instance ({result}): install a driver, on Debian or Ubuntu \
                 with `apt install mesa-vulkan-drivers`"
            ))
        })?;
        let mut instance = Instance {
            raw,
            debug_utils,
            messenger: None,
            messages,
            validation,
            presents: display.is_some(),
            entry,
        };
        if validation {
            let utils = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            messenger_info.p_next = std::ptr::null();
            // SAFETY: the extension is enabled, and the user data lives as long as the messenger (see Drop).
            let messenger = check("vkCreateDebugUtilsMessengerEXT", unsafe {
                utils.create_debug_utils_messenger(&messenger_info, None)
            })?;
            instance.messenger = Some((utils, messenger));
        }
        Ok(instance)
    }

    /// Whether it was made for windows.
    pub fn presents(&self) -> bool {
        self.presents
    }

    /// Whether the validation layer watches.
    pub fn validation(&self) -> bool {
        self.validation
    }

    /// What the validation layer has said since the last call.
    pub fn take_messages(&self) -> Vec<String> {
        match self.messages.lock() {
            Ok(mut messages) => std::mem::take(&mut messages),
            Err(poisoned) => std::mem::take(&mut poisoned.into_inner()),
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: every device made from the instance holds a share of it, so none is left here.
        unsafe {
            if let Some((utils, messenger)) = self.messenger.take() {
                utils.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
        // Messages nobody took must not vanish: teardown is where leaks are reported.
        for message in self.take_messages() {
            tracing::error!("validation: {message}");
            if self.validation && std::env::var_os("MARMOR_REQUIRE_VALIDATION").is_some() {
                eprintln!("validation message at teardown: {message}");
                std::process::abort();
            }
        }
    }
}

/// Receives the layer's messages.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid callback data, and `user` is the instance's boxed
    // list, which lives until the messenger is destroyed.
    let (text, list) = unsafe {
        let text = (*data).message_as_c_str().map_or_else(
            || "(no text)".to_owned(),
            |text| text.to_string_lossy().into_owned(),
        );
        (text, &*user.cast::<Mutex<Vec<String>>>())
    };
    if let Ok(mut list) = list.lock() {
        list.push(text);
    }
    vk::FALSE
}
