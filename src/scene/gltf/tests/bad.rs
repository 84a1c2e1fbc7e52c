//! Files that are refused, and what they are told.

use super::cases::{CASES, good, set};
use super::*;

#[test]
fn faults_name_their_place_and_a_remedy_on_one_line() {
    assert!(good().model().rig.is_some());
    for (case, change, fragments) in CASES {
        let mut file = good();
        change(&mut file);
        let message = file.fault();
        for fragment in *fragments {
            assert!(
                message.contains(fragment),
                "{case}: {fragment:?} not in: {message}"
            );
        }
        assert!(message.starts_with("bad.glb: "), "{case}: {message}");
        assert_eq!(message.lines().count(), 1, "{case}: {message}");
        assert!(
            message.contains("; ") || message.contains(", so "),
            "{case}: {message}"
        );
    }
}

#[test]
fn faults_of_the_container() {
    let good = good().glb();
    let changed = |at: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[at] = byte;
        bytes
    };
    for (bytes, fragment) in [
        (vec![], "the file is empty"),
        (b"v 0 0 0\n".to_vec(), "JSON"),
        (b"glTF".to_vec(), "cut short"),
        (good[..12].to_vec(), "cut short"),
        (good[..good.len() - 4].to_vec(), "cut short"),
        (changed(4, 1), "version 1"),
        (changed(10, 0xff), "declares"),
        (changed(16, b'X'), "JSON chunk"),
        (changed(15, 1), "chunk 0"),
        (changed(20, b'['), "line 1"),
        (
            [&good[..8], &[0; 4][..], &good[12..]].concat(),
            "JSON chunk",
        ),
    ] {
        let message = fault(&bytes);
        assert!(message.contains(fragment), "{fragment}: {message}");
        assert!(message.starts_with("bad.glb: "), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[test]
fn deep_and_wide_hierarchies_are_no_matter() {
    let mut file = Builder::new();
    file.tetrahedron();
    let depth = 100_000;
    let nodes: Vec<Value> = (0..depth).map(|i| json!({"children": [i + 1]})).collect();
    file.json["nodes"] = nodes.into();
    file.push("nodes", json!({"mesh": 0}));
    assert_eq!(file.model().shapes[0].triangles.len(), 4);
    set(
        &mut file,
        &format!("/nodes/{depth}"),
        json!({"children": [0]}),
    );
    assert!(file.fault().contains("ring"));
}

#[test]
fn damaged_files_are_refused_or_read_but_never_panic() {
    let good = good().glb();
    let read = |bytes: &[u8]| match super::super::parse(bytes, "bad.glb", None) {
        Ok(model) => {
            // What was read can be posed.
            model.posed(&model.pose(1.0, 0, None, 0.0));
            for clip in model.rig.iter().flat_map(|rig| &rig.clips) {
                for time in [0.0, 0.5, 9.0] {
                    model.posed(&model.pose(1.0, 0, Some(clip), time));
                }
            }
            true
        }
        Err(error) => {
            assert_eq!(error.to_string().lines().count(), 1, "{error}");
            false
        }
    };
    assert!(read(&good));
    for end in (0..good.len()).step_by(3) {
        assert!(!read(&good[..end]), "{end} of {} bytes", good.len());
    }
    // A multiplicative generator (Lehmer, with the constant of L'Ecuyer 1999, table 4).
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(3_512_401_965_023_503_517) | 1;
        ((state >> 33) as usize) % below
    };
    let mut read_all_the_same = 0;
    for _ in 0..3000 {
        let mut bytes = good.clone();
        let at = random(bytes.len());
        // Half of them digits, which keep the JSON valid.
        bytes[at] = match random(2) {
            0 => random(256) as u8,
            _ => b'0' + random(10) as u8,
        };
        read_all_the_same += usize::from(read(&bytes));
    }
    assert!(read_all_the_same > 300, "{read_all_the_same}");
}
