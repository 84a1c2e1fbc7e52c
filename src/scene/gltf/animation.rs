//! Clips: a file's animations.

use super::super::Error;
use super::super::clip::{Channel, Clip, Interpolation, Values};
use super::super::model::{Joint, Local};
use super::accessor::{ATTRIBUTE, FLOAT, Wanted};
use super::container::Source;
use super::hierarchy::{Hierarchy, label, unit};
use super::{EXPORT_ANEW, called};
use glam::DQuat;
use gltf::json;
use gltf::json::accessor::Type;
use gltf::json::animation::{Interpolation as How, Property};
use gltf::json::validation::Checked;
use std::collections::HashSet;

/// All clips that move a node of `hierarchy`.
pub(super) fn clips(source: &Source, hierarchy: &Hierarchy) -> Result<Vec<Clip>, Error> {
    let mut clips = Vec::new();
    let mut names = HashSet::new();
    for (index, animation) in source.root.animations.iter().enumerate() {
        let given = animation.name.clone().filter(|name| !name.is_empty());
        let given = given.unwrap_or_else(|| format!("clip {index}"));
        let mut name = given.clone();
        let mut copy = 2;
        while !names.insert(name.clone()) {
            name = format!("{given} {copy}");
            copy += 1;
        }
        let called = called("animation", index, animation.name.as_ref());
        clips.extend(clip(source, hierarchy, animation, name, &called)?);
    }
    Ok(clips)
}

/// Whether a clip moves one of `joints` or a morph weight.
pub(super) fn moves(clip: &Clip, hierarchy: &Hierarchy, joints: &[Joint]) -> bool {
    let mut carries = vec![false; hierarchy.nodes.len()];
    for joint in joints {
        carries[joint.node] = true;
    }
    for (index, node) in hierarchy.nodes.iter().enumerate().rev() {
        if let Some(parent) = node.parent {
            carries[parent] |= carries[index];
        }
    }
    clip.channels.iter().any(|channel| match channel.values {
        Values::Weights(_) => true,
        _ => carries[channel.node],
    })
}

/// One clip; none if it moves nothing of the hierarchy.
fn clip(
    source: &Source,
    hierarchy: &Hierarchy,
    animation: &json::Animation,
    name: String,
    called: &str,
) -> Result<Option<Clip>, Error> {
    if animation.channels.is_empty() {
        return Err(source.fault(&format!(
            "{called} has no channels, so its length is zero; give it keyframes or remove it"
        )));
    }
    let mut channels = Vec::new();
    for (number, channel) in animation.channels.iter().enumerate() {
        let place = format!("{called}, channel {number}");
        channels.extend(self::channel(
            source, hierarchy, animation, channel, &place,
        )?);
    }
    if channels.is_empty() {
        tracing::debug!(
            "{}: {called} moves nothing of the scene; skipped",
            source.name
        );
        return Ok(None);
    }
    let ends = channels.iter().filter_map(|c: &Channel| c.times.last());
    let duration = ends.copied().fold(0.0, f64::max);
    if duration <= 0.0 {
        return Err(source.fault(&format!(
            "{called} has its only keyframes at 0 s, so its length is zero; \
             give it a keyframe later on or remove it"
        )));
    }
    Ok(Some(Clip {
        name,
        duration,
        channels,
    }))
}

/// One channel; none if it targets what is not read.
fn channel(
    source: &Source,
    hierarchy: &Hierarchy,
    animation: &json::Animation,
    channel: &json::animation::Channel,
    place: &str,
) -> Result<Option<Channel>, Error> {
    let fault = |problem: String| source.fault(&format!("{place}: {problem}"));
    let skipped = |why: &str| {
        tracing::debug!("{}: {place}: {why}; skipped", source.name);
        Ok(None)
    };
    let target = channel.target.node.value();
    let Some(&node) = hierarchy.places.get(target) else {
        let count = hierarchy.places.len();
        return Err(fault(format!(
            "it moves node {target}, and there are {count}; {EXPORT_ANEW}"
        )));
    };
    let Some(node) = node else {
        return skipped("its node is not in the scene");
    };
    let Checked::Valid(property) = channel.target.path else {
        return skipped("its property is none of glTF 2.0");
    };
    let targets = hierarchy.nodes[node].weights.len();
    if property == Property::MorphTargetWeights && targets == 0 {
        return skipped("its node has no morph targets");
    }
    if property != Property::MorphTargetWeights
        && matches!(hierarchy.nodes[node].local, Local::Matrix(_))
    {
        return Err(fault(format!(
            "it moves {}, which is placed by a matrix; \
             export it with translation, rotation and scale",
            label(source, target)
        )));
    }
    let sampler = animation.samplers.get(channel.sampler.value());
    let sampler = sampler.ok_or_else(|| {
        fault(format!(
            "there is no sampler {}; {EXPORT_ANEW}",
            channel.sampler
        ))
    })?;
    let interpolation = match sampler.interpolation {
        Checked::Valid(How::Step) => Interpolation::Step,
        Checked::Valid(How::Linear) => Interpolation::Linear,
        Checked::Valid(How::CubicSpline) => Interpolation::CubicSpline,
        Checked::Invalid => {
            return Err(fault(format!(
                "its interpolation is none of glTF 2.0; {EXPORT_ANEW}"
            )));
        }
    };
    let times = times(source, sampler, place)?;
    let each = match interpolation {
        Interpolation::CubicSpline => 3,
        Interpolation::Step | Interpolation::Linear => 1,
    };
    let elements = each * times.len();
    let output = sampler.output;
    let at = format!("{place}, values");
    let values = match property {
        Property::Translation => {
            Values::Translation(source.vectors(output, &at, FLOAT, Some(elements))?)
        }
        Property::Scale => Values::Scale(source.vectors(output, &at, FLOAT, Some(elements))?),
        Property::Rotation => {
            let wanted = Wanted {
                shape: Type::Vec4,
                components: ATTRIBUTE,
                count: Some(elements),
            };
            let numbers = source.finite(output, &at, &wanted)?;
            let rotations = numbers.chunks_exact(4).enumerate().map(|(i, c)| {
                let raw = [c[0], c[1], c[2], c[3]];
                if each == 3 && i % 3 != 1 {
                    return Ok(DQuat::from_array(raw));
                }
                unit(raw).ok_or_else(|| {
                    fault(format!(
                        "the rotation at keyframe {} is zero; {EXPORT_ANEW}",
                        i / each
                    ))
                })
            });
            Values::Rotation(rotations.collect::<Result<_, _>>()?)
        }
        Property::MorphTargetWeights => {
            let wanted = Wanted {
                shape: Type::Scalar,
                components: ATTRIBUTE,
                count: Some(elements.saturating_mul(targets)),
            };
            Values::Weights(source.finite(output, &at, &wanted)?)
        }
    };
    Ok(Some(Channel {
        node,
        times,
        interpolation,
        values,
    }))
}

/// Times of the keyframes of a sampler, s: at least one, ascending from 0 or later.
fn times(
    source: &Source,
    sampler: &json::animation::Sampler,
    place: &str,
) -> Result<Vec<f64>, Error> {
    let wanted = Wanted {
        shape: Type::Scalar,
        components: FLOAT,
        count: None,
    };
    let place = format!("{place}, times");
    let times = source.finite(sampler.input, &place, &wanted)?;
    let fault = |problem: String| {
        let input = sampler.input;
        Err(source.fault(&format!(
            "{place} (accessor {input}): {problem}; {EXPORT_ANEW}"
        )))
    };
    let Some(&first) = times.first() else {
        return fault("there are no keyframes".to_owned());
    };
    if first < 0.0 {
        return fault(format!("keyframe 0 is at {first} s, before 0"));
    }
    let pairs = times.windows(2);
    if let Some(at) = pairs.map(|t| t[1] - t[0]).position(|step| step <= 0.0) {
        return fault(format!(
            "keyframe {} is at {} s, not after keyframe {at} at {} s",
            at + 1,
            times[at + 1],
            times[at]
        ));
    }
    Ok(times)
}
