//! What the mouse and the keys do.

use super::style;

/// What one does, and what it does.
const KEYS: [(&str, &str); 20] = [
    ("drag", "turn the camera"),
    ("right drag, Ctrl or L drag", "turn the light"),
    ("middle drag, Shift drag", "move the camera"),
    ("wheel, pinch", "zoom"),
    ("two fingers", "turn; with Shift, move"),
    ("double click, F", "all of the object in the picture"),
    ("arrows", "turn the light by five degrees"),
    ("Space", "play, pause"),
    ("M", "the next method"),
    ("S", "split against the opaque picture; drag the line"),
    ("1  2  3", "specular, single, multiple scattering"),
    ("[  ]", "a quarter of a stop darker, brighter"),
    ("D", "the next way of looking at it"),
    ("E", "error against exact: drag a rectangle"),
    ("C", "costs on or off"),
    ("P", "save PNG, EXR and scene"),
    ("F1", "these lines"),
    ("Esc", "back to the picture"),
    ("Ctrl Q", "close"),
    ("drop a file", "open a scene or a mesh"),
];

/// Shows them in a window of their own, which `open` closes.
pub fn show(context: &egui::Context, open: &mut bool) {
    egui::Window::new("Keys")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO)
        .show(context, |ui| {
            egui::Grid::new("keys")
                .num_columns(2)
                .spacing([24.0, 5.0])
                .show(ui, |ui| {
                    for (key, does) in KEYS {
                        ui.label(egui::RichText::new(key).color(style::WARM));
                        ui.label(does);
                        ui.end_row();
                    }
                });
        });
}
