//! Splits the input events of one frame into several runs of the interface. egui reads the pointer's position and the
//! modifier keys once per run; a slow frame may hold a complete drag, whose start, end and modifiers would otherwise be
//! lost.

use egui::{Event, RawInput};

/// What egui is to be run with in turn: a button of the mouse goes alone, and a change of Shift, Ctrl or Alt comes first.
pub fn input_runs(input: RawInput) -> Vec<RawInput> {
    let events = input.events.clone();
    let mut runs: Vec<RawInput> = events
        .chunk_by(|event, next| !is_button(event) && !is_button(next) && !is_modifiers(next))
        .map(|events| RawInput {
            events: events.to_vec(),
            ..input.clone()
        })
        .collect();
    if runs.is_empty() {
        runs.push(input);
    }
    runs
}

fn is_button(event: &Event) -> bool {
    matches!(event, Event::PointerButton { .. })
}

fn is_modifiers(event: &Event) -> bool {
    matches!(event, Event::ModifiersChanged(_))
}

#[cfg(test)]
mod tests {
    use egui::{Modifiers, PointerButton, pos2};

    use super::*;

    fn events_in_turn(events: &[Event]) -> Vec<usize> {
        let events = events.to_vec();
        let input = RawInput {
            events,
            ..RawInput::default()
        };
        input_runs(input)
            .iter()
            .map(|run| run.events.len())
            .collect()
    }

    fn button(pressed: bool) -> Event {
        Event::PointerButton {
            pos: pos2(0.0, 0.0),
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        }
    }

    const MOVED: Event = Event::PointerMoved(pos2(1.0, 2.0));

    #[test]
    fn a_button_is_pressed_and_let_go_in_turns_of_their_own() {
        let drag = [MOVED, button(true), MOVED, MOVED, button(false), MOVED];
        assert_eq!(events_in_turn(&drag), [1, 1, 2, 1, 1]);
    }

    #[test]
    fn modifiers_hold_for_what_follows() {
        let shift = [Modifiers::SHIFT, Modifiers::NONE].map(Event::ModifiersChanged);
        let [held, free] = shift;
        assert_eq!(events_in_turn(&[MOVED, held, MOVED, free]), [1, 2, 1]);
    }

    #[test]
    fn without_events_there_is_one_turn() {
        assert_eq!(events_in_turn(&[]), [0]);
    }
}
