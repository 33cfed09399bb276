//! Where controls differ about a code that all have: what it does here, and what elsewhere.

use super::codes::Code;

/// What to know about a code that means other things on other controls.
pub fn note(code: &Code) -> Option<&'static str> {
    let found =
        NOTES.iter().find(|(letter, tenths, _)| (*letter, *tenths) == (code.letter, code.tenths));
    found.map(|(.., note)| *note)
}

/// A row a code: letter, ten times its number, note.
#[rustfmt::skip]
static NOTES: &[(u8, u16, &str)] = &[
    (b'G', 0, "All axes arrive together here (rapid = \"straight\"); on many controls each goes at its own speed, and the way is bent."),
    (b'G', 20, "A full circle needs I J K and no axis word that differs. R negative is the long way. P is how many turns. Ends may differ from the circle within arc_radius_tolerance_mm; in inches 2.54 times as far."),
    (b'G', 30, "As G2."),
    (b'G', 40, "P is in seconds here and on LinuxCNC and grbl; on FANUC in milliseconds if it has no point, on 3D printers always. X or U are seconds too."),
    (b'G', 70, "On Haas and FANUC there is no such code: lathes are in diameters by a setting."),
    (b'G', 80, "On FANUC G8 P1 is look-ahead control."),
    (b'G', 100, "L2 and L20 set work coordinates, L1, L10 and L11 tools; FANUC numbers the work systems differently in L20."),
    (b'G', 200, "On older European controls G70."),
    (b'G', 210, "On older European controls G71."),
    (b'G', 280, "Axis words are a point on the way, then only these axes go to the reference. On Heidenhain: a mirror image. On 3D printers: homes."),
    (b'G', 300, "As G28, to the second reference position."),
    (b'G', 410, "The tool's radius is that of D, or of the tool in the spindle. FANUC takes D as the number of an offset."),
    (b'G', 420, "As G41, on the right."),
    (b'G', 430, "Without H the length is that of the tool in the spindle. A move in the same block goes with the new length. On Siemens: something else."),
    (b'G', 490, "On FANUC H0 does the same."),
    (b'G', 500, "On FANUC lathes G50 S is the greatest spindle speed, and G50 X Z sets the position."),
    (b'G', 510, "I J K are factors; P is one for all axes. FANUC takes P in thousandths if it has no point."),
    (b'G', 520, "A shift of all work coordinate systems, until G52 X0 Y0 Z0."),
    (b'G', 530, "For one block, and only beside G0 or G1."),
    (b'G', 640, "P is how far a corner may be cut; on Siemens G64 is continuous path without a tolerance. Q joins no lines here: on LinuxCNC it joins those that are nearly one."),
    (b'G', 650, "A to Z become #1 to #26 of the subprogram."),
    (b'G', 680, "R is the angle in degrees about X Y. On FANUC lathes: double turrets."),
    (b'G', 730, "On FANUC lathes: pattern repeating."),
    (b'G', 740, "On FANUC lathes: peck drilling along Z."),
    (b'G', 760, "On FANUC and LinuxCNC lathes: a threading cycle."),
    (b'G', 830, "Between pecks the tool goes out to R; on FANUC a parameter decides between G73 and G83."),
    (b'G', 840, "Spindle and feed are not synchronised: the tap needs a floating holder."),
    (b'G', 900, "On FANUC lathes of system A: a turning cycle; there X Z are positions and U W distances."),
    (b'G', 920, "On FANUC lathes of system A: a threading cycle."),
    (b'G', 940, "On FANUC lathes of system A: a facing cycle, and G98 is feed a minute."),
    (b'G', 950, "On FANUC lathes of system A: G99."),
    (b'G', 980, "On FANUC lathes of system A: feed a minute."),
    (b'G', 990, "On FANUC lathes of system A: feed a turn. On Heidenhain: defines a tool."),
    (b'M', 10, "Always an event here: whether it stops is for the operator's switch."),
    (b'M', 60, "The tool is that of the last T. On lathes T alone changes tools."),
    (b'M', 300, "Modes are as at the start again: G17 G21 G40 G49 G54 G61 G80 G90 G94 G97."),
    (b'M', 480, "On FANUC and others a function of the machine."),
    (b'M', 600, "On some controls: changes a tool or the work by itself."),
    (b'M', 980, "P51000 without L is program 1000 five times under --dialect fanuc."),
    (b'M', 990, "In the main program it ends the run here, with a warning; on FANUC it begins anew for ever."),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gcode::codes::CODES;

    #[test]
    fn every_note_is_one_of_a_code() {
        assert_eq!(CODES.iter().filter_map(note).count(), NOTES.len());
    }
}
