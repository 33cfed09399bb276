//! The rules that a program can break: name, severity and one sentence each. `samples/bad/` holds
//! a program for every one of them, `samples/mended/` the same without the mistake.

use crate::base::{Axis, Severity};

/// A rule that a program can break.
#[derive(PartialEq, Eq)]
pub struct Rule {
    /// Its name, as shown and as `samples/bad/` names its file.
    pub name: &'static str,
    /// How bad it is to break it.
    pub severity: Severity,
    /// What is wrong with a program that breaks it.
    pub meaning: &'static str,
    /// A program that breaks it; its first line is a comment that tells the diagnostic.
    pub bad: &'static str,
    /// The same program without the mistake.
    pub mended: &'static str,
}

/// By its name: the programs would hide all else.
impl std::fmt::Debug for Rule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Rule").field(&self.name).finish()
    }
}

/// A rule, with its programs from the samples.
macro_rules! rule {
    ($severity:ident $name:literal $meaning:expr) => {
        Rule {
            name: $name,
            severity: Severity::$severity,
            meaning: $meaning,
            bad: include_str!(concat!("../../samples/bad/", $name, ".nc")),
            mended: include_str!(concat!("../../samples/mended/", $name, ".nc")),
        }
    };
}

macro_rules! rules {
    ($($id:ident $severity:ident $name:literal $meaning:literal;)*) => {
        $(
            #[doc = $meaning]
            pub static $id: Rule = rule!($severity $name $meaning);
        )*
        static LISTED: &[&Rule] = &[$(&$id),*];
    };
}

rules! {
    NOT_TEXT Error "not-text" "The file holds bytes that no NC program has: it is something else.";
    LINE_TOO_LONG Error "line-too-long" "A line is longer than 64 KiB.";
    BAD_CHARACTER Error "bad-character" "A character that belongs to no word and no comment.";
    LOOK_ALIKE Error "look-alike" "A character that looks like one of a program and is another, as a typographic minus.";
    DECIMAL_COMMA Error "decimal-comma" "A comma stands where a decimal point belongs.";
    OPEN_COMMENT Error "open-comment" "A comment begins with ( and has no ) on its line.";
    NESTED_COMMENT Error "nested-comment" "A comment inside of a comment: controls differ in where it ends.";
    MISSING_NUMBER Error "missing-number" "A letter is not followed by a number.";
    BAD_NUMBER Error "bad-number" "A number that cannot be read, or that is too large.";
    REPEATED_WORD Error "repeated-word" "A letter that may stand once in a block stands there twice.";
    UNKNOWN_WORD Error "unknown-word" "A word that means nothing in any dialect known here.";
    FOREIGN_WORD Warning "foreign-word" "A word that another control needs is left out (--lenient).";
    UNSUPPORTED_WORD Error "unsupported-word" "A word that means something elsewhere and is not supported here.";
    EXPRESSION Error "expression" "An expression or a statement of control flow that cannot be read.";
    ARITHMETIC Error "arithmetic" "An expression has no value: a division by zero, the root of a negative number and the like.";
    UNSET_PARAMETER Error "unset-parameter" "A named parameter is read before it is set.";
    BAD_PARAMETER Error "bad-parameter" "A parameter that there is not, or that cannot be set.";
    MODAL_CONFLICT Error "modal-conflict" "Two words of one modal group stand in one block.";
    UNUSED_WORD Error "unused-word" "A word that nothing in its block makes use of.";
    MISSING_WORD Error "missing-word" "A code lacks a word that it needs.";
    BAD_VALUE Error "bad-value" "A word has a value that it cannot have.";
    NO_MOTION_MODE Error "no-motion-mode" "Axis words where no motion code is in force.";
    NO_FEED Error "no-feed" "A straight move, an arc or a spline where no feed has been given.";
    NO_SPINDLE_SPEED Error "no-spindle-speed" "A feed a turn (G95) where the spindle's speed is not known.";
    SPINDLE_STOPPED Error "spindle-stopped" "A cycle that needs the spindle turning, where it does not turn, or turns the wrong way.";
    SPINDLE_SYNC Error "spindle-sync" "A thread or a rigid tap on a machine whose axes cannot follow the spindle's turns.";
    NO_INPUTS Error "no-inputs" "Probing or waiting for an input on a machine whose nodes have no inputs.";
    FEED_TOO_LOW Error "feed-too-low" "A movement would take longer than ten days at its feed, or has next to none.";
    MISSING_AXIS Error "missing-axis" "A word moves an axis that the machine does not have.";
    NOTHING_SAVED Error "nothing-saved" "M72 restores modes that nothing has saved, or that M71 has forgotten.";
    MACHINE_COORDINATES Error "machine-coordinates" "G53 stands in a block without a G0 or G1 movement.";
    AXIS_WORDS_TWICE Error "axis-words-twice" "Two codes of one block both make use of its axis words.";
    SYSTEM_UNSET Warning "system-unset" "A work coordinate system that nothing has placed: it is taken at the machine's work zero.";
    REFERENCE_UNSET Error "reference-unset" "G28 or G30 goes to a reference position that neither the profile nor the program tells.";
    UNKNOWN_TOOL Error "unknown-tool" "A tool whose length or diameter is needed does not stand in the tool table.";
    OFFSET_UNSET Warning "offset-unset" "A T word of a lathe calls an offset that the tool table does not hold: it is taken as 0.";
    TRANSFORMED Error "transformed" "An offset is set while scaling, rotation or polar coordinates are in force.";
    CYCLE_LEVEL Error "cycle-level" "The R level of a canned cycle lies below its bottom.";
    CYCLE_MODE Error "cycle-mode" "A canned cycle stands where the modes in force leave no room for one.";
    CONTOUR Error "contour" "The contour of a lathe cycle is none, or cannot be cut as the cycle cuts.";
    CONTOUR_WORD Warning "contour-word" "The contour of a lathe cycle holds words that mean nothing to it.";
    CORNER Error "corner" "A fillet, a chamfer or the angle of a line for which the two moves leave no place.";
    COMPENSATION_MODE Error "compensation-mode" "Something stands in cutter compensation that has no place there.";
    COMPENSATION_GOUGE Error "compensation-gouge" "The tool does not fit into the contour.";
    ARC_DISTORTED Error "arc-distorted" "An arc would be no arc after unequal scaling, or after a rotation out of its plane.";
    ARC_CENTER Error "arc-center" "An arc has neither a centre nor a radius, or both.";
    ARC_RADIUS Error "arc-radius" "The two ends of an arc lie at different distances from its centre.";
    ARC_RADIUS_DOUBTFUL Warning "arc-radius-doubtful" "The radii of an arc's ends differ more than rounding explains, within the machine's tolerance.";
    ARC_TOO_SMALL Error "arc-too-small" "The radius of an arc is zero, or too small to reach from its start to its end.";
    ARC_CLOSED Error "arc-closed" "A full circle is asked for by its radius, which leaves its centre open.";
    SPLINE_MODE Error "spline-mode" "A spline stands where the modes in force leave no room for one.";
    SPLINE_AXIS Error "spline-axis" "A spline has a word of an axis that it does not move.";
    SPLINE_TANGENT Error "spline-tangent" "The first G5 of a row does not say in which direction it begins.";
    NURBS_ORDER Error "nurbs-order" "The order of a NURBS is too low or too high.";
    NURBS_POINTS Error "nurbs-points" "A NURBS has fewer points than its order, or too many.";
    NURBS_WEIGHT Error "nurbs-weight" "The weight of a point of a NURBS is not above zero, or beyond all measure.";
    NURBS_KNOTS Error "nurbs-knots" "The knots of a NURBS decrease, or make no curve from its first point to its last.";
    NURBS_START Error "nurbs-start" "The first point of G6.2 is not where the machine stands.";
    NURBS_OPEN Error "nurbs-open" "Something else stands in a NURBS, or the program ends in one.";
    NURBS_UNOPENED Error "nurbs-unopened" "G5.3 ends a NURBS that G5.2 has not begun.";
    PULSE_RATE Error "pulse-rate" "A feed at which the machine's interpolator would have to make more pulses than it can.";
    SPINDLE_SPEED Warning "spindle-speed" "A spindle speed beyond the machine's greatest.";
    RAPID_INTO_WORK Warning "rapid-into-work" "G0 goes down below Z0 of the work while the spindle turns.";
    FEED_UNITS Warning "feed-units" "A block sets the feed and changes the units, which controls take in different orders.";
    BLOCK_DELETE Warning "block-delete" "Lines that begin with / are executed: block delete is off.";
    CALL_ALONE Error "call-alone" "Other words stand beside a subroutine call or a statement of control flow.";
    UNKNOWN_SUBPROGRAM Error "unknown-subprogram" "A call of a subprogram that the file does not hold.";
    DUPLICATE_PROGRAM Error "duplicate-program" "Two programs of one file have the same number.";
    MISSING_RETURN Error "missing-return" "A subprogram ends without M99.";
    RECURSION Error "recursion" "A subprogram calls itself, directly or through others.";
    CALL_DEPTH Error "call-depth" "Calls within calls, deeper than 10.";
    CALL_COUNT Error "call-count" "More than a million subroutine calls in one run.";
    SUBPROGRAM_SIZE Error "subprogram-size" "The subprograms that are called hold more than 50000 blocks.";
    UNMATCHED_FLOW Error "unmatched-flow" "A loop, a condition or a subprogram without its end, or an end without its beginning.";
    UNKNOWN_LABEL Error "unknown-label" "GOTO leads to an N word that the program does not have.";
    MAX_PASSES Error "max-passes" "The loops of a program make more passes than allowed (--max-passes), or all of it too many moves.";
    ALARM Error "alarm" "The program raises an alarm by setting #3000.";
    OUTSIDE_FOLDER Error "outside-folder" "A subprogram's file lies outside of the program's folder and of those given by --include.";
    EMPTY_PROGRAM Error "empty-program" "The file holds no block.";
    NEVER_CALLED Warning "never-called" "A subprogram that is never called has a fault.";
    MISSING_END Warning "missing-end" "The program's text ends without M2, M30 or a closing %.";
    AFTER_END Warning "after-end" "Blocks after the program's end, outside of any subprogram, are never executed.";
}

macro_rules! limits {
    ($($axis:ident $min:literal $max:literal;)*) => {
        /// The rules of travel: for each axis, below its least and above its greatest position.
        pub static LIMITS: [[Rule; 2]; 9] = [$([
            rule!(Error $min concat!(stringify!($axis), " moves below its least machine position.")),
            rule!(Error $max concat!(stringify!($axis), " moves above its greatest machine position.")),
        ]),*];
    };
}

limits! {
    X "limit-x-min" "limit-x-max";
    Y "limit-y-min" "limit-y-max";
    Z "limit-z-min" "limit-z-max";
    A "limit-a-min" "limit-a-max";
    B "limit-b-min" "limit-b-max";
    C "limit-c-min" "limit-c-max";
    U "limit-u-min" "limit-u-max";
    V "limit-v-min" "limit-v-max";
    W "limit-w-min" "limit-w-max";
}

/// The rules of an axis's travel: below its least, and above its greatest position.
pub fn limits(axis: Axis) -> &'static [Rule; 2] {
    &LIMITS[axis as usize]
}

/// Every rule.
pub fn all() -> impl Iterator<Item = &'static Rule> {
    LISTED.iter().copied().chain(LIMITS.iter().flatten())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinct_and_limits_are_those_of_their_axis() {
        let names: std::collections::BTreeSet<_> = all().map(|rule| rule.name).collect();
        assert_eq!(names.len(), all().count());
        for axis in Axis::ALL {
            let letter = axis.letter().to_ascii_lowercase();
            assert_eq!(limits(axis)[0].name, format!("limit-{letter}-min"));
            assert_eq!(limits(axis)[1].name, format!("limit-{letter}-max"));
        }
    }
}
