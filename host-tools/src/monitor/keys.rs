//! What the keys do. They are read by a thread of their own, so that a screen that hangs leaves the stop key working.

use std::io;
use std::time::Duration;

use bowden_host_link::operator::{Desk, Order};
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

/// Longest wait for a key before the thread checks whether to end.
const WAKE: Duration = Duration::from_millis(50);

/// Reads keys until the end was asked for.
///
/// # Errors
/// When the terminal is gone; the end is asked for then.
pub fn read(desk: &Desk) -> io::Result<()> {
    let result = read_until_over(desk);
    if result.is_err() {
        desk.quit();
    }
    result
}

fn read_until_over(desk: &Desk) -> io::Result<()> {
    while !desk.is_over() {
        if event::poll(WAKE)?
            && let Event::Key(key) = event::read()?
            && key.kind != KeyEventKind::Release
        {
            act(desk, key);
        }
    }
    Ok(())
}

fn act(desk: &Desk, key: KeyEvent) {
    match key.code {
        KeyCode::Char(' ') => desk.stop(),
        KeyCode::Char('c' | 'd') if key.modifiers.contains(KeyModifiers::CONTROL) => desk.quit(),
        KeyCode::Char('q') | KeyCode::Esc => desk.quit(),
        KeyCode::Char('a') => desk.order(Order::Arm),
        KeyCode::Char('h') => desk.order(Order::Home),
        KeyCode::Char('r') => desk.order(Order::Run),
        KeyCode::Char('c') => desk.order(Order::ClearFault),
        _ => {}
    }
}
