//! How the panel looks: quiet greys around the picture, one warm colour for what is on.

use egui::{Color32, CornerRadius, FontFamily, FontId, Margin, Stroke, TextStyle, Theme, Visuals};

/// The panel's ground.
pub const GROUND: Color32 = Color32::from_rgb(0x16, 0x17, 0x19);
/// Behind the picture: [`super::session::BACKDROP`], as a display shows it.
pub const BACKDROP: Color32 = Color32::from_rgb(0x1f, 0x20, 0x21);
/// What stands on it, a little lighter.
pub const RAISED: Color32 = Color32::from_rgb(0x22, 0x24, 0x27);
/// Under the pointer.
pub const HOVERED: Color32 = Color32::from_rgb(0x2d, 0x30, 0x34);
/// Lines between sections.
pub const LINE: Color32 = Color32::from_rgb(0x2c, 0x2f, 0x33);
/// Words.
pub const TEXT: Color32 = Color32::from_rgb(0xd4, 0xd7, 0xda);
/// Words that name other words.
pub const DIM: Color32 = Color32::from_rgb(0x8d, 0x93, 0x99);
/// What is on, chosen, or the picture's own.
pub const WARM: Color32 = Color32::from_rgb(0xe3, 0xa6, 0x72);
/// The same, as a ground.
pub const WARM_GROUND: Color32 = Color32::from_rgb(0x5a, 0x40, 0x2b);
/// What only the panel took.
pub const COOL: Color32 = Color32::from_rgb(0x5f, 0x8d, 0xa6);
/// Faults.
pub const FAULT: Color32 = Color32::from_rgb(0xef, 0x7f, 0x6d);

/// Width of the panel, points.
pub const WIDTH: f32 = 328.0;
/// Height of the strip of costs, points.
pub const STRIP: f32 = 190.0;
/// Width of the names of settings, points.
pub const NAMES: f32 = 92.0;

/// A heading of a section.
pub fn heading() -> FontId {
    FontId::new(11.0, FontFamily::Proportional)
}

/// Numbers.
pub fn numbers() -> FontId {
    FontId::new(11.5, FontFamily::Monospace)
}

/// Dresses `context`.
pub fn dress(context: &egui::Context) {
    context.set_theme(Theme::Dark);
    context.all_styles_mut(|style| {
        style.text_styles = [
            (
                TextStyle::Heading,
                FontId::new(19.0, FontFamily::Proportional),
            ),
            (TextStyle::Body, FontId::new(13.0, FontFamily::Proportional)),
            (
                TextStyle::Button,
                FontId::new(13.0, FontFamily::Proportional),
            ),
            (TextStyle::Monospace, numbers()),
            (TextStyle::Small, heading()),
        ]
        .into();
        style.drag_value_text_style = TextStyle::Monospace;
        let spacing = &mut style.spacing;
        spacing.item_spacing = egui::vec2(6.0, 5.0);
        spacing.button_padding = egui::vec2(7.0, 2.0);
        spacing.interact_size = egui::vec2(34.0, 19.0);
        spacing.slider_width = 118.0;
        spacing.combo_width = 130.0;
        spacing.window_margin = Margin::same(14);
        spacing.scroll = egui::style::ScrollStyle::thin();

        let mut visuals = Visuals::dark();
        visuals.panel_fill = GROUND;
        visuals.window_fill = GROUND;
        visuals.extreme_bg_color = Color32::from_rgb(0x0f, 0x10, 0x11);
        visuals.window_stroke = Stroke::new(1.0, LINE);
        visuals.selection.bg_fill = WARM_GROUND;
        visuals.selection.stroke = Stroke::new(1.0, WARM);
        visuals.hyperlink_color = WARM;
        visuals.slider_trailing_fill = true;
        visuals.handle_shape = egui::style::HandleShape::Rect { aspect_ratio: 0.45 };
        let corner = CornerRadius::same(3);
        let widgets = &mut visuals.widgets;
        for (widget, ground, ink) in [
            (&mut widgets.noninteractive, GROUND, DIM),
            (&mut widgets.inactive, RAISED, TEXT),
            (&mut widgets.hovered, HOVERED, TEXT),
            (&mut widgets.active, WARM_GROUND, Color32::WHITE),
            (&mut widgets.open, HOVERED, TEXT),
        ] {
            widget.bg_fill = ground;
            widget.weak_bg_fill = ground;
            widget.bg_stroke = Stroke::NONE;
            widget.fg_stroke = Stroke::new(1.0, ink);
            widget.corner_radius = corner;
            widget.expansion = 0.0;
        }
        widgets.noninteractive.bg_stroke = Stroke::new(1.0, LINE);
        style.visuals = visuals;
    });
}
