//! Events of the pointer, one after another.
//!
//! egui looks once a pass where the pointer is and whether its button is down. While a picture is drawn a hand can do more
//! than that: of a button that goes down, is dragged and goes up again within one long frame, egui would see nothing, and
//! take a press for one at the place to which the pointer went on afterwards. Nor would it know, of a number that is typed and
//! confirmed within one frame, that its digits were no shortcuts.

use egui::{Event, Key};

/// Leaves in `events` what a single pass can take in: moves of the pointer, or one change of its buttons; keys, or one that
/// may change who listens to them; and all that is neither. Returns the others, which later passes take in.
pub fn split(events: &mut Vec<Event>) -> Vec<Event> {
    // Whether the last event of the pointer was one of its buttons, and the last key one that may move the focus.
    let (mut button, mut focus) = (None, None);
    let ends = |event: &Event| {
        let (types, now) = match event {
            Event::PointerButton { .. } => (false, true),
            Event::PointerMoved(_) | Event::PointerGone => (false, false),
            Event::Key {
                pressed: true, key, ..
            } => (true, matches!(key, Key::Enter | Key::Tab | Key::Escape)),
            Event::Text(_) | Event::Paste(_) => (true, false),
            _ => return false,
        };
        // A click may have moved the focus, too.
        let clicked = types && button == Some(true);
        let last = if types { &mut focus } else { &mut button };
        clicked || last.replace(now).is_some_and(|before| before || now)
    };
    let end = events.iter().position(ends).unwrap_or(events.len());
    events.split_off(end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Modifiers, PointerButton, pos2};

    fn moved(x: f32) -> Event {
        Event::PointerMoved(pos2(x, 0.0))
    }

    fn button(x: f32, pressed: bool) -> Event {
        Event::PointerButton {
            pos: pos2(x, 0.0),
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        }
    }

    /// Events that come at once are taken in by `passes`.
    fn comes_in(passes: &[Vec<Event>]) {
        let mut events = passes.concat();
        for pass in passes {
            let rest = split(&mut events);
            assert_eq!(events, *pass);
            events = rest;
        }
        assert!(events.is_empty());
    }

    /// What a pass of a small window takes in.
    fn input(events: Vec<Event>) -> egui::RawInput {
        let size = egui::vec2(200.0, 50.0);
        egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(pos2(0.0, 0.0), size)),
            events,
            ..Default::default()
        }
    }

    #[test]
    fn a_pass_sees_one_button() {
        let text = || Event::Text("a".to_owned());
        let neither = || Event::WindowFocused(true);
        let all = [
            vec![text(), moved(0.0), moved(1.0), text()],
            vec![button(1.0, true), neither()],
            vec![text(), moved(2.0), moved(3.0)],
            vec![button(3.0, false)],
            vec![button(3.0, true)],
            vec![button(3.0, false)],
            vec![text(), Event::PointerGone],
        ];
        comes_in(&all);
        assert!(split(&mut Vec::new()).is_empty());
    }

    fn key(key: Key) -> Event {
        Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        }
    }

    #[test]
    fn what_confirms_comes_by_itself() {
        let text = || Event::Text("3".to_owned());
        let all = [
            vec![key(Key::Num3), text(), moved(0.0), key(Key::M), key(Key::M)],
            vec![key(Key::Enter)],
            vec![key(Key::Tab), moved(1.0)],
            vec![key(Key::Num3), text()],
        ];
        comes_in(&all);
    }

    /// Digits of a number are for it alone, although all of it is typed and confirmed within one frame.
    #[test]
    fn digits_are_no_shortcuts() {
        let context = egui::Context::default();
        let (mut number, mut shortcuts) = (0.0, 0);
        let mut pass = |events: Vec<Event>| {
            let typed = context.text_edit_focused();
            let _ = context.run_ui(input(events), |ui| {
                ui.add(egui::DragValue::new(&mut number));
            });
            if !typed && !context.text_edit_focused() {
                shortcuts += context.input(|input| input.num_presses(Key::Num3));
            }
        };
        pass(vec![]);
        let mut events = vec![
            moved(20.0),
            button(20.0, true),
            button(20.0, false),
            key(Key::Num3),
            Event::Text("3".to_owned()),
            key(Key::Enter),
            key(Key::Num3),
        ];
        while !events.is_empty() {
            let later = split(&mut events);
            pass(std::mem::replace(&mut events, later));
        }
        // The one after it is one.
        assert_eq!((number, shortcuts), (3.0, 1));
    }

    /// What a widget makes of events that came within one frame.
    fn dragged(events: Vec<Event>, split_up: bool) -> (egui::Vec2, u32) {
        let context = egui::Context::default();
        let (mut by, mut clicks) = (egui::Vec2::ZERO, 0);
        let mut pass = |events: Vec<Event>| {
            let _ = context.run_ui(input(events), |ui| {
                let sense = egui::Sense::click_and_drag();
                let rect = egui::Rect::from_min_size(pos2(0.0, 0.0), egui::vec2(100.0, 50.0));
                let response = ui.interact(rect, egui::Id::new("left"), sense);
                if response.dragged() || response.drag_stopped() {
                    by += ui.input(|input| input.pointer.delta());
                }
                clicks += u32::from(response.clicked());
            });
        };
        // What is laid out first can be pointed at.
        pass(vec![moved(10.0)]);
        let mut events = events;
        while !events.is_empty() {
            let rest = if split_up {
                split(&mut events)
            } else {
                Vec::new()
            };
            pass(std::mem::replace(&mut events, rest));
        }
        pass(Vec::new());
        (by, clicks)
    }

    #[test]
    fn a_drag_within_a_frame_is_one() {
        let drag = || {
            vec![
                button(10.0, true),
                moved(40.0),
                moved(60.0),
                button(60.0, false),
                moved(90.0),
            ]
        };
        assert_eq!(dragged(drag(), true), (egui::vec2(50.0, 0.0), 0));
        // What all this is for.
        assert_ne!(dragged(drag(), false).0, egui::vec2(50.0, 0.0));
        // One that ends beside the widget began on it.
        let beyond = vec![button(10.0, true), moved(150.0), button(150.0, false)];
        assert_eq!(dragged(beyond, true), (egui::vec2(140.0, 0.0), 0));
        let click = vec![button(10.0, true), button(10.0, false), moved(150.0)];
        assert_eq!(dragged(click, true), (egui::Vec2::ZERO, 1));
    }
}
