//! Proof that the validation layer would speak: it must report a hazard planted here.
//!
//! A silent test run means something only as long as this test sees a message.

use std::sync::Arc;

use ash::vk;

use super::{Buffer, Candidate, Device, Instance, Location, Slot, Use, barrier};

/// Two copies into one buffer, with or without a barrier between them.
fn messages(ordered: bool) -> Option<Vec<String>> {
    let required = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty() && v != "0");
    let instance = match Instance::new(true, None, None) {
        Ok(instance) => Arc::new(instance),
        Err(error) => {
            assert!(!required("MARMOR_REQUIRE_VALIDATION"), "{error}");
            eprintln!("skipped: {error}");
            return None;
        }
    };
    let wanted = std::env::var("MARMOR_DEVICE").ok();
    let found =
        Candidate::list(&instance).and_then(|list| Candidate::choose(&list, wanted.as_deref()));
    let candidate = match found {
        Ok(candidate) => candidate,
        Err(error) => {
            assert!(!required("MARMOR_REQUIRE_DEVICE"), "{error}");
            eprintln!("skipped: {error}");
            return None;
        }
    };
    let device = Device::new(&instance, &candidate).expect("a device");
    let buffer = |name, usage| {
        Buffer::new(&device, name, 256, usage, Location::Device).expect("a small buffer")
    };
    let source = buffer("source", vk::BufferUsageFlags::TRANSFER_SRC);
    let target = buffer("target", vk::BufferUsageFlags::TRANSFER_DST);
    let mut slot = Slot::new(&device, "canary").expect("a command buffer");
    let commands = slot.begin().expect("recording");
    let copy = || {
        let region = [vk::BufferCopy {
            src_offset: 0,
            dst_offset: 0,
            size: 256,
        }];
        // SAFETY: both buffers hold 256 bytes and outlive the wait below; the hazard between
        // two copies leaves their common target undefined, and nothing reads it.
        unsafe {
            device
                .raw
                .cmd_copy_buffer(commands, source.raw, target.raw, &region)
        };
    };
    copy();
    if ordered {
        barrier::buffer(
            &device,
            commands,
            c"WAW: the second copy overwrites the first",
            &target,
            Use::COPY_TARGET,
            Use::COPY_TARGET,
        );
    }
    copy();
    slot.submit().expect("a submit");
    slot.wait().expect("its end");
    Some(instance.take_messages())
}

#[test]
fn a_planted_hazard_is_reported() {
    if let Some(messages) = messages(false) {
        let seen = messages.iter().any(|m| {
            m.contains("SYNC-HAZARD-WRITE-AFTER-WRITE")
                || m.contains("SYNC-HAZARD-WRITE_AFTER_WRITE")
        });
        assert!(seen, "the layer did not see the hazard: {messages:?}");
    }
}

#[test]
fn a_barrier_silences_it() {
    if let Some(messages) = messages(true) {
        assert!(messages.is_empty(), "{messages:?}");
    }
}
