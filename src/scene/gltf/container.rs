//! What a glTF file is made of: its JSON, and the buffers that the JSON refers to.

use super::super::{Error, bytes};
use super::EXPORT_ANEW;
use base64::Engine as _;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::{Root, buffer::Buffer};
use serde::Deserialize;
use std::borrow::Cow;
use std::path::Path;

/// The first bytes of a .glb.
const MAGIC: &[u8] = b"glTF";

/// Exporters differ in whether they pad.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Extensions that a file may require: accessors of these components are read anyway, and textures are not read at all.
const UNDERSTOOD: [&str; 4] = [
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
];

/// A file taken apart.
pub(super) struct Source<'a> {
    /// Stands for the file in messages.
    pub name: &'a str,
    /// Its JSON. Nothing in it has been checked but its types.
    pub root: Root,
    /// Bytes of each buffer, as many as it declares.
    pub buffers: Vec<Cow<'a, [u8]>>,
}

/// What says whether the rest can be understood, and so is read before it.
#[derive(Deserialize)]
struct Head {
    asset: Asset,
    #[serde(default, rename = "extensionsRequired")]
    extensions_required: Vec<String>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
}

impl<'a> Source<'a> {
    /// Takes a .gltf or .glb apart; external buffers are looked for in `folder`.
    pub fn open(bytes: &'a [u8], name: &'a str, folder: Option<&Path>) -> Result<Self, Error> {
        let (json, mut binary) = if bytes.starts_with(MAGIC) {
            chunks(bytes).map_err(|problem| fault(name, &problem))?
        } else {
            (bytes, None)
        };
        let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
        let malformed = |error: gltf::json::Error| {
            let problem =
                format!("its JSON is not that of a glTF 2.0 file ({error}); {EXPORT_ANEW}");
            fault(name, &problem)
        };
        let head: Head = serde_json::from_slice(json).map_err(malformed)?;
        head.check().map_err(|problem| fault(name, &problem))?;
        let root = Root::from_slice(json).map_err(malformed)?;

        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (index, buffer) in root.buffers.iter().enumerate() {
            // Only the first can be the chunk of a .glb.
            let data = contents(buffer, binary.take(), folder)
                .and_then(|data| cut(data, buffer.byte_length.0))
                .map_err(|problem| fault(name, &format!("buffer {index}{problem}")))?;
            buffers.push(data);
        }
        Ok(Source {
            name,
            root,
            buffers,
        })
    }

    /// A fault of this file.
    pub fn fault(&self, problem: &str) -> Error {
        fault(self.name, problem)
    }
}

/// An error on one line, whatever the file put into its names.
fn fault(name: &str, problem: &str) -> Error {
    let line = |c: char| if c.is_control() { ' ' } else { c };
    Error::of(name, problem.chars().map(line).collect::<String>())
}

impl Head {
    fn check(&self) -> Result<(), String> {
        let version = &self.asset.version;
        if version.split('.').next() != Some("2") {
            return Err(format!(
                "it is glTF {version:?}, and 2.0 is read; export it as glTF 2.0"
            ));
        }
        for extension in &self.extensions_required {
            let remedy = match extension.as_str() {
                known if UNDERSTOOD.contains(&known) => continue,
                "KHR_draco_mesh_compression" => "switch off Draco compression in the export",
                "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
                    "switch off meshopt compression in the export (gltfpack: no -c or -cc)"
                }
                _ => "export it without that",
            };
            return Err(format!(
                "it requires the extension {extension:?}, which is not supported; {remedy}"
            ));
        }
        Ok(())
    }
}

/// The JSON and the binary chunk of a .glb (glTF 2.0, 4.4).
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let short = || "the .glb is cut short; copy or export it anew".to_owned();
    let number = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    let version = number(4).ok_or_else(short)?;
    if version != 2 {
        return Err(format!(
            "it is a .glb of version {version}, and 2 is read; export it as glTF 2.0"
        ));
    }
    let end = number(8).ok_or_else(short)? as usize;
    if end > bytes.len() {
        return Err(format!(
            "the .glb declares {end} bytes and has {}: it is cut short; copy or export it anew",
            bytes.len()
        ));
    }
    let mut found = Vec::new();
    let mut at = 12;
    while at < end {
        let length = number(at).ok_or_else(short)? as usize;
        let kind = number(at + 4).ok_or_else(short)?.to_le_bytes();
        let start = at + 8;
        at = start.saturating_add(length);
        let data = bytes[..end].get(start..at).ok_or_else(|| {
            format!(
                "chunk {} of the .glb ends beyond the file: it is cut short or corrupt; {EXPORT_ANEW}",
                found.len()
            )
        })?;
        found.push((kind, data));
    }
    match found[..] {
        [(kind, json), ref rest @ ..] if kind == *b"JSON" => {
            // Chunks of other kinds are to be ignored.
            let binary = rest.iter().find(|(kind, _)| kind == b"BIN\0");
            // The padding should be spaces.
            let padding = json.iter().rev().take_while(|&&b| b == 0).count();
            Ok((&json[..json.len() - padding], binary.map(|(_, data)| *data)))
        }
        _ => Err(format!(
            "the .glb does not begin with its JSON chunk: it is corrupt; {EXPORT_ANEW}"
        )),
    }
}

/// The bytes of a buffer: the .glb's own, those in its URI, or those of another file. A problem reads on from "buffer N".
fn contents<'a>(
    buffer: &Buffer,
    binary: Option<&'a [u8]>,
    folder: Option<&Path>,
) -> Result<Cow<'a, [u8]>, String> {
    let Some(uri) = &buffer.uri else {
        return binary.map(Cow::Borrowed).ok_or_else(|| {
            format!(" has neither a URI nor the binary chunk of a .glb; {EXPORT_ANEW}")
        });
    };
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, data)) = data.split_once(";base64,") else {
            return Err(format!(
                "'s data URI is not in base64; {EXPORT_ANEW}, as .glb"
            ));
        };
        let decoded = BASE64.decode(data.trim_end());
        return decoded.map(Cow::Owned).map_err(|error| {
            format!(
                "'s data URI is not base64 ({error}): it is cut short or corrupt; {EXPORT_ANEW}"
            )
        });
    }
    let Some(folder) = folder else {
        return Err(format!(
            " lies in a file of its own, {uri:?}, which cannot be looked for here; export it as .glb"
        ));
    };
    let path = percent_decoded(uri);
    if uri.contains("://") || Path::new(&path).is_absolute() {
        return Err(format!(
            " lies at {uri:?}, which is no path beside the file; export it as .glb"
        ));
    }
    bytes::read(&folder.join(path))
        .map(Cow::Owned)
        .map_err(|error| {
            let problem = error.problem.split(';').next().unwrap_or_default();
            format!(
                " lies in a file of its own, {uri:?}: {problem}; keep the two together, or export as .glb"
            )
        })
}

/// The first `length` bytes.
fn cut(data: Cow<'_, [u8]>, length: u64) -> Result<Cow<'_, [u8]>, String> {
    let has = data.len();
    match usize::try_from(length) {
        Ok(length) if length <= has => Ok(match data {
            Cow::Borrowed(data) => Cow::Borrowed(&data[..length]),
            Cow::Owned(mut data) => {
                data.truncate(length);
                Cow::Owned(data)
            }
        }),
        _ => Err(format!(
            " declares {length} bytes and has {has}: its data is cut short; copy or export it anew"
        )),
    }
}

/// A URI's `%20` and the like as the characters they stand for; what is malformed stays.
fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let digits = bytes.get(at + 1..at + 3).filter(|_| byte == b'%');
        let decoded = digits
            .and_then(|digits| std::str::from_utf8(digits).ok())
            .and_then(|digits| u8::from_str_radix(digits, 16).ok());
        at += if decoded.is_some() { 3 } else { 1 };
        out.push(decoded.unwrap_or(byte));
    }
    String::from_utf8(out).unwrap_or_else(|_| uri.to_owned())
}
