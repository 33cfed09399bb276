//! `[plc]` of a profile: the delays of M, S and T functions by handshake (seed 001, section 6).

use super::keys::Keys;

/// TMF and TFIN unless the profile says otherwise: those of the paper's experiment.
const DELAY_MS: u32 = 30;
/// Greatest delay that the paper's parameters take.
const DELAY_MOST_MS: u32 = 999;

/// How a machine's PLC is spoken to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlcProfile {
    /// Bits a second on its line.
    pub baud: u32,
    /// From a code to its strobe.
    pub tmf_ms: u32,
    /// For which FIN has to stand.
    pub tfin_ms: u32,
    /// Longest wait for FIN, and for its end.
    pub timeout_s: f64,
}

impl Default for PlcProfile {
    fn default() -> Self {
        PlcProfile { baud: 38_400, tmf_ms: DELAY_MS, tfin_ms: DELAY_MS, timeout_s: 30.0 }
    }
}

impl PlcProfile {
    /// Reads `[plc]`.
    pub(super) fn read(keys: &mut Keys<'_>) -> Option<PlcProfile> {
        if !keys.has_table("plc") {
            return None;
        }
        let usual = PlcProfile::default();
        let delays = 1..=DELAY_MOST_MS;
        Some(PlcProfile {
            baud: keys.integer_if("plc.baud", 300..=10_000_000).unwrap_or(usual.baud),
            tmf_ms: keys.integer_if("plc.tmf_ms", delays.clone()).unwrap_or(usual.tmf_ms),
            tfin_ms: keys.integer_if("plc.tfin_ms", delays).unwrap_or(usual.tfin_ms),
            timeout_s: keys.number_if("plc.timeout_s", 0.1..=86_400.0).unwrap_or(usual.timeout_s),
        })
    }
}
