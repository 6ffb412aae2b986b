//! Proof: differences on data that the fit did not see, by channel and by regime.

use maud::{Markup, html};

use crate::diagnose::verdict::{Findings, RegimeResidual};

use super::{figures, map, names};

/// Names of the three simulations that are compared, with the class that draws each.
const STAGES: [(&str, &str); 3] =
    [("rig file", "before"), ("recalibrated", "recalibrated"), ("diagnosed", "after")];
/// Length of the longest bar, px.
const LONGEST_PX: f64 = 200.0;

/// Section on proof.
pub(super) fn section(findings: &Findings) -> Markup {
    let fit = &findings.diagnosis.fit;
    let data = if fit.heldout { "held-out data" } else { "the data of the fit itself" };
    html! {
        section #proof {
            h2 { "Proof on " (data) }
            @if fit.channels.is_empty() {
                p { "No channel was compared." }
            } @else {
                table.proof {
                    caption {
                        "Root mean square difference between recording and simulation on " (data)
                        ": with the rig file as it was, recalibrated, and with the diagnosed physics. "
                        "The noise floor is what the sensors alone would leave."
                        @if fit.channels.values().any(|rmse| rmse.free_run) {
                            " A free run follows the torque alone over the whole recording, so that errors add up; the plots by regime, position,                              speed and time are of the joint held to its recorded angle, as the diagnosis compared it."
                        }
                        (key(true))
                    }
                    thead { tr {
                        th scope="col" { "Channel" }
                        th scope="col" { "Unit" }
                        th.number scope="col" { "Rig file" }
                        th.number scope="col" { "Recalibrated" }
                        th.number scope="col" { "Diagnosed" }
                        th.number scope="col" { "Noise floor" }
                        th.number scope="col" { "Diagnosed / noise" }
                        th scope="col" { span.unseen { "Bars" } }
                    } }
                    tbody { @for (name, rmse) in &fit.channels {
                        @let stages = [rmse.before_rmse, rmse.recalibrated_rmse, rmse.after_rmse];
                        @let exponent =
                            figures::shared_exponent(longest(stages.into_iter().chain([rmse.noise_rmse])));
                        @let scaled = |value: f64| figures::number(value / 10_f64.powi(exponent));
                        tr {
                            th scope="row" {
                                (names::channel(name)) " " code { (name) }
                                @if rmse.free_run { ", free run" }
                            }
                            td { (figures::scaled_unit(exponent, names::unit_of(findings, name))) }
                            @for stage in stages { td.number { (scaled(stage)) } }
                            td.number { (scaled(rmse.noise_rmse)) }
                            td.number { (figures::number(rmse.after_rmse / rmse.noise_rmse)) }
                            td { (bars(stages, rmse.noise_rmse)) }
                        }
                    } }
                }
            }
            (by_regime(&findings.regimes))
            (map::part(findings))
        }
    }
}

/// Which bar is which.
fn key(has_floor: bool) -> Markup {
    html! {
        span.key { @for (name, class) in STAGES {
            svg viewBox="0 0 26 12" width="26" height="12" aria-hidden="true" {
                rect class=(class) x="1" y="2" width="24" height="8" {}
            }
            (name)
        }
        @if has_floor {
            svg viewBox="0 0 26 12" width="26" height="12" aria-hidden="true" {
                line.floor x1="13" x2="13" y1="0" y2="12" {}
            }
            "noise floor"
        } }
    }
}

fn bars(stages: [f64; 3], noise: f64) -> Markup {
    let longest = longest(stages.into_iter().chain([noise]));
    let px = |value: f64| length_px(value, longest);
    html! {
        svg.bars viewBox="0 0 204 30" preserveAspectRatio="none" aria-hidden="true" {
            @for (i, (value, (_, class))) in stages.into_iter().zip(STAGES).enumerate() {
                rect class=(class) x="1" y=(2 + 9 * i) width=(px(value)) height="7" {}
            }
            @if noise.is_finite() { line.floor x1=(px(noise)) x2=(px(noise)) y1="0" y2="30" {} }
        }
    }
}

fn by_regime(regimes: &[RegimeResidual]) -> Markup {
    let mut channels: Vec<&str> = Vec::new();
    for regime in regimes {
        if !channels.contains(&regime.channel.as_str()) {
            channels.push(&regime.channel);
        }
    }
    html! {
        @if !channels.is_empty() {
            h3 { "Difference by regime of motion" }
            p.caption { "Root mean square difference in each regime; bars of one channel share a scale." (key(false)) }
            div.regimes { @for name in channels {
                @let rows: Vec<&RegimeResidual> = regimes.iter().filter(|r| r.channel == name).collect();
                (regime_chart(name, &rows))
            } }
        }
    }
}

fn regime_chart(name: &str, rows: &[&RegimeResidual]) -> Markup {
    const ROW_PX: usize = 42;
    let unit = rows.first().map_or("1", |row| row.unit.as_str());
    let stages = |row: &RegimeResidual| [row.before_rmse, row.recalibrated_rmse, row.after_rmse];
    let longest = longest(rows.iter().flat_map(|row| stages(row)));
    let exponent = figures::shared_exponent(longest);
    let scaled_unit = figures::scaled_unit(exponent, unit);
    let height = ROW_PX * rows.len();
    html! {
        figure.regime {
            figcaption { (names::channel(name)) " " code { (name) } @if !scaled_unit.is_empty() { ", " (scaled_unit) } }
            svg viewBox=(format!("0 0 350 {height}")) role="img" {
                title { "Difference by regime, " (names::channel(name)) }
                desc { @for row in rows {
                    (row.regime) ": "
                    @for (value, (stage, _)) in stages(row).into_iter().zip(STAGES) {
                        (stage) " " (figures::quantity(value, unit)) ", "
                    }
                } }
                @for (i, row) in rows.iter().enumerate() {
                    @let top = ROW_PX * i;
                    text.end x="64" y=(top + 23) { (names::words(&row.regime)) }
                    @for (k, (value, (_, class))) in stages(row).into_iter().zip(STAGES).enumerate() {
                        @let length = length_px(value, longest);
                        rect class=(class) x="72" y=(top + 3 + 12 * k) width=(length) height="8" {}
                        text.small x=(format!("{:.1}", 79.0 + length)) y=(top + 11 + 12 * k) { (figures::number(value / 10_f64.powi(exponent))) }
                    }
                }
            }
        }
    }
}

fn longest(values: impl Iterator<Item = f64>) -> f64 {
    values.filter(|v| v.is_finite()).fold(0.0, f64::max)
}

/// Length of a bar, px, to a tenth; a value that is not zero stays visible.
fn length_px(value: f64, longest: f64) -> f64 {
    if !(value.is_finite() && value > 0.0 && longest > 0.0) {
        return 0.0;
    }
    ((LONGEST_PX * value / longest).max(0.5) * 10.0).round() / 10.0
}
