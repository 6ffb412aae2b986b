//! Every fault of the protocol is provoked by a test: whoever adds a fault has to name its test here.

use bowden_link::Fault;

/// Sources of the tests that provoke faults.
const SOURCES: [&str; 8] = [
    include_str!("faults.rs"),
    include_str!("failures.rs"),
    include_str!("flash.rs"),
    include_str!("parameters.rs"),
    include_str!("clock.rs"),
    include_str!("ripple_table.rs"),
    include_str!("motor_lead.rs"),
    include_str!("bridge.rs"),
];

/// The test that provokes `fault`.
fn test_of(fault: Fault) -> &'static str {
    match fault {
        Fault::EncoderCheck => "an_open_encoder_line_fails_its_check",
        Fault::EncoderParity => "a_wrong_bit_of_an_as5045_fails_its_parity",
        Fault::EncoderStatus => "a_lost_magnet_of_an_as5045_says_so",
        Fault::EncoderMissing => "an_encoder_bus_that_stands_is_a_missing_encoder",
        Fault::EncoderStuck => "an_encoder_that_stands_is_found",
        Fault::JointSpeed => "a_joint_that_turns_too_fast_is_found",
        Fault::JointRange => "a_joint_beyond_its_range_is_found",
        Fault::TrackingError => "a_joint_that_does_not_follow_is_found",
        Fault::TensionStuck => "a_tension_channel_that_stands_is_found",
        Fault::TensionSwapped => "exchanged_tension_channels_are_found",
        Fault::TensionRestless => "a_tension_channel_that_jumps_about_is_found",
        Fault::MotorCurrent => "a_leg_at_ground_stops_before_a_tendon_is_overloaded",
        Fault::DriverWarning => "a_warning_of_the_gate_driver_is_told_from_its_fault",
        Fault::EncoderJump => "a_loose_magnet_is_a_jump",
        Fault::TensionRail => "a_broken_tension_wire_is_at_a_rail",
        Fault::Slack | Fault::OverTension => "slack_and_overload_are_found",
        Fault::TensionInconsistent => "tensions_that_do_not_fit_the_friction_are_found",
        Fault::StretchInconsistent => "tensions_that_contradict_the_stretch_are_found",
        Fault::OverCurrent => "over_current_stops_in_three_ticks",
        Fault::WindingHot => "a_hot_winding_stops",
        Fault::MotorOpen => "an_open_motor_lead_is_named",
        Fault::BusUnderVoltage | Fault::BusOverVoltage => "a_bus_voltage_out_of_range_stops",
        Fault::BridgeFault => "a_fault_of_the_bridge_stops_at_once",
        Fault::TickOverrun => "a_late_tick_is_a_fault",
        Fault::HostSilent => "a_host_that_falls_silent_stops_the_joint",
        Fault::ParameterStoreCorrupt => "a_broken_store_is_told_and_defaults_are_used",
        Fault::RippleTableCorrupt => "a_damaged_table_is_told_and_the_motor_stays_off",
        Fault::Watchdog => "a_hang_ends_with_the_watchdog_and_the_motor_is_off_long_before",
        Fault::Panic => "a_panic_stops_the_motor_and_leaves_its_words",
        Fault::HardFault => "a_processor_fault_stops_the_motor_and_says_where",
        Fault::ClockFailed => "a_crystal_that_stops_opens_the_bridge_at_once_and_is_a_named_fault",
        Fault::ProcessorSupply => "a_supply_of_the_processor_that_falls_opens_the_bridge_in_hardware",
        Fault::FlashDamaged => "damaged_code_opens_the_bridge_and_is_a_named_fault",
        Fault::FlashBanks => "a_flash_of_one_bank_is_told_and_nothing_is_stored",
        Fault::RestartLoop => "three_restarts_without_a_host_end_in_safe_mode",
        Fault::StackOverflow => "a_stack_that_runs_over_its_end_stops_the_motor_and_is_a_named_fault",
        Fault::SelfTestTimeout => "a_restless_sensor_ends_the_self_test",
        Fault::PretensionOff => "lost_pretension_is_found_before_the_bridge_is_on",
        Fault::HomingTimeout => "homing_that_does_not_arrive_ends",
    }
}

#[test]
fn every_fault_is_provoked() {
    for fault in Fault::ALL {
        let test = format!("#[test]\nfn {}() -> Outcome {{", test_of(*fault));
        let source = SOURCES.iter().find(|source| source.contains(&test));
        let body = source.and_then(|source| source.split(&test).nth(1)).unwrap_or_default();
        let body = body.split("\n}\n").next().unwrap_or_default();
        assert!(body.contains(&format!("Fault::{fault:?}")), "{fault:?} is not in {}", test_of(*fault));
    }
}
