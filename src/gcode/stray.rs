//! What stands in a line where no word can begin, and what was meant by it: commas for points,
//! characters of word processors for those of programs, statements of other languages.

use super::fault::Fault;
use super::rules;

/// A character that is taken for one of a program and is another.
struct LookAlike {
    /// Bytes that it takes in the line.
    length: usize,
    name: String,
    /// The character that was meant.
    meant: char,
}

/// Characters that stand for one of a program: dashes, blanks, quotes, and letters of other scripts.
const LOOK_ALIKES: &[(char, char, &str)] = &[
    ('\u{2212}', '-', "minus sign"),
    ('\u{2010}', '-', "hyphen"),
    ('\u{2011}', '-', "no-break hyphen"),
    ('\u{2012}', '-', "figure dash"),
    ('\u{2013}', '-', "en dash"),
    ('\u{2014}', '-', "em dash"),
    ('\u{2015}', '-', "horizontal bar"),
    ('\u{00ad}', '-', "soft hyphen"),
    ('\u{00a0}', ' ', "no-break space"),
    ('\u{2007}', ' ', "figure space"),
    ('\u{2009}', ' ', "thin space"),
    ('\u{202f}', ' ', "narrow no-break space"),
    ('\u{3000}', ' ', "ideographic space"),
    ('\u{200b}', ' ', "zero-width space"),
    ('\u{feff}', ' ', "byte order mark"),
    ('\u{00b7}', '.', "middle dot"),
    ('\u{2024}', '.', "one dot leader"),
    ('\u{201a}', ',', "low quotation mark"),
    ('\u{00d7}', '*', "multiplication sign"),
    ('\u{2044}', '/', "fraction slash"),
    ('\u{2215}', '/', "division slash"),
    ('А', 'A', "Cyrillic letter"),
    ('В', 'B', "Cyrillic letter"),
    ('Е', 'E', "Cyrillic letter"),
    ('К', 'K', "Cyrillic letter"),
    ('М', 'M', "Cyrillic letter"),
    ('Н', 'H', "Cyrillic letter"),
    ('О', 'O', "Cyrillic letter"),
    ('Р', 'P', "Cyrillic letter"),
    ('С', 'C', "Cyrillic letter"),
    ('Т', 'T', "Cyrillic letter"),
    ('У', 'Y', "Cyrillic letter"),
    ('Х', 'X', "Cyrillic letter"),
    ('Ι', 'I', "Greek letter"),
    ('Μ', 'M', "Greek letter"),
    ('Ν', 'N', "Greek letter"),
    ('Χ', 'X', "Greek letter"),
    ('Υ', 'Y', "Greek letter"),
    ('Ζ', 'Z', "Greek letter"),
];

/// Bytes of Windows-1252, where they are no UTF-8.
const LOOK_ALIKE_BYTES: &[(u8, char, &str)] = &[
    (0x96, '-', "en dash (Windows-1252)"),
    (0x97, '-', "em dash (Windows-1252)"),
    (0xad, '-', "soft hyphen (Windows-1252)"),
    (0xa0, ' ', "no-break space (Windows-1252)"),
];

/// The look-alike that a text begins with.
fn look_alike(text: &[u8]) -> Option<LookAlike> {
    let first = *text.first().filter(|byte| !byte.is_ascii())?;
    let Some(found) = first_char(text) else {
        let (_, meant, name) = LOOK_ALIKE_BYTES.iter().find(|(byte, ..)| *byte == first)?;
        return Some(LookAlike { length: 1, name: (*name).to_owned(), meant: *meant });
    };
    let number = u32::from(found);
    // The full-width forms of ASCII follow its order.
    let (meant, name) = match number {
        0xff01..=0xff5e => (char::from_u32(number - 0xfee0)?, "full-width character"),
        _ => {
            let upper = found.to_uppercase().next().unwrap_or(found);
            let (_, meant, name) = LOOK_ALIKES.iter().find(|(other, ..)| *other == upper)?;
            (*meant, *name)
        }
    };
    let name = format!("{name} (U+{number:04X})");
    Some(LookAlike { length: found.len_utf8(), name, meant })
}

/// The character that a text begins with, if it is UTF-8 so far.
fn first_char(text: &[u8]) -> Option<char> {
    let chunk = text.get(..4).unwrap_or(text).utf8_chunks().next()?;
    chunk.valid().chars().next()
}

/// A fault of a text that begins with look-alikes, and how many bytes it spoils: up to where the
/// words go on. `from` is where the word that they are in begins, `at` where they do.
pub(super) fn look_alike_fault(line: &[u8], from: usize, at: usize) -> Option<(Fault, usize)> {
    let first = look_alike(line.get(at..)?)?;
    let mut meant = String::from_utf8_lossy(line.get(from..at)?).into_owned();
    let mut end = at;
    while let Some(rest) = line.get(end..) {
        // A blank ends the number, unless it is what stands between a letter and its number.
        let next = look_alike(rest).filter(|next| next.meant != ' ' || first.meant == ' ');
        if let Some(next) = next {
            meant.push(next.meant);
            end += next.length;
        } else if let Some(byte) = rest.first().filter(|byte| b"0123456789.+-".contains(byte)) {
            meant.push(char::from(*byte));
            end += 1;
        } else {
            break;
        }
    }
    let LookAlike { name, meant: plain, .. } = first;
    let message = match plain {
        ' ' => format!("{name} in place of a plain blank"),
        _ => format!("{name} in place of {plain}"),
    };
    let fault = Fault::new(&rules::LOOK_ALIKE, from as u32, end as u32, message);
    let fault = match meant.trim() {
        "" => fault.help("type it anew in a plain text editor"),
        meant => fault.help(format!("write {meant}")),
    };
    Some((fault, end - at))
}

/// A fault of a word that begins at byte `from` and goes on at byte `at` with the letter O where 0
/// is meant (`GO`, `X1O5`), or with l for 1; and how many bytes it spoils.
pub(super) fn letter_for_digit(line: &[u8], from: usize, at: usize) -> Option<(Fault, usize)> {
    let rest = line.get(at..)?;
    let is_upper = line.get(from)?.is_ascii_uppercase();
    let is_first = at == from + 1;
    if from > 0 && line[from - 1].is_ascii_alphabetic() {
        return None;
    }
    match rest.first()? {
        b'O' | b'o' => {}
        b'l' if is_first && is_upper => {}
        _ => return None,
    }
    let end = rest.iter().take_while(|byte| b"0123456789.+-Ool".contains(byte)).count();
    // A program number may follow a line number; words and keywords have letters behind the O.
    let follows = rest.get(end..end + 2).unwrap_or_default();
    let is_program = line[from].eq_ignore_ascii_case(&b'N') && end > 1;
    if is_program || matches!(follows, [a, b] if a.is_ascii_alphabetic() && b.is_ascii_alphabetic())
    {
        return None;
    }
    let text = String::from_utf8_lossy(line.get(from..at + end)?);
    let (letter, number) = text.split_at_checked(1)?;
    let meant = letter.to_ascii_uppercase() + &number.replace(['O', 'o'], "0").replace('l', "1");
    let fault =
        Fault::new(&rules::LOOK_ALIKE, from as u32, (at + end) as u32, "a letter in a number");
    Some((fault.help(format!("write {meant}")), end))
}

/// What to write instead of a sign of other languages in an expression.
pub(super) fn operator_help(byte: u8) -> Option<&'static str> {
    match byte {
        b'(' => Some("( begins a comment: write [ and ], as SIN[30]"),
        b'=' => Some("a comparison is EQ, as [#1 EQ 2]"),
        b'<' => Some("a comparison is LT or LE, as [#1 LT 2]"),
        b'>' => Some("a comparison is GT or GE, as [#1 GT 2]"),
        b'!' => Some("a comparison is NE, as [#1 NE 2]"),
        b'^' => Some("a power is **, as [2 ** 3]"),
        b'&' => Some("write AND"),
        b'|' => Some("write OR"),
        b'%' => Some("a remainder is MOD, as [7 MOD 3]"),
        _ => None,
    }
}

/// Makes one fault of letters without numbers that follow each other at once, from the given fault
/// on: they are a text.
pub(super) fn join_texts(line: &[u8], faults: &mut Vec<Fault>, first: usize) {
    let mut joined: Vec<Fault> = Vec::new();
    for fault in faults.drain(first..) {
        let is_letter = |fault: &Fault| fault.rule == &rules::MISSING_NUMBER;
        match joined.last_mut().filter(|last| is_letter(last) && last.end == fault.start) {
            Some(last) if is_letter(&fault) => last.end = fault.end,
            _ => joined.push(fault),
        }
    }
    for fault in joined.iter_mut().filter(|fault| fault.end - fault.start > 1) {
        let text = line.get(fault.start as usize..fault.end as usize).unwrap_or_default();
        let text = String::from_utf8_lossy(text);
        if fault.rule != &rules::MISSING_NUMBER {
            continue;
        }
        let is_unit = ["MM", "IN", "CM", "DEG"].contains(&text.to_ascii_uppercase().as_str());
        fault.message = format!("{text} are letters without numbers");
        fault.help = Some(if is_unit {
            "leave the unit out: G21 says millimetres, G20 inches".to_owned()
        } else {
            "a remark stands in ( ) or after ;".to_owned()
        });
    }
    faults.append(&mut joined);
}

/// A fault of a text that begins with a comma, and how many bytes it spoils.
pub(super) fn comma(line: &[u8], at: usize) -> (Fault, usize) {
    let (before, after) = (&line[..at], &line[at + 1..]);
    let digits = after.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let is_in_number = before.last().is_some_and(u8::is_ascii_alphanumeric) && digits > 0;
    if is_in_number {
        return decimal_comma(line, at, digits);
    }
    let message = "a comma is no part of any word";
    let fault = Fault::new(&rules::BAD_CHARACTER, at as u32, at as u32 + 1, message);
    // Arguments behind it would be taken for a fault of their own.
    let is_argument = after.trim_ascii_start().first() == Some(&b'[');
    let length = if is_argument { line.len() - at } else { 1 };
    (fault.help("leave it out: words and arguments stand one after the other"), length)
}

/// `X1,5`: marks the word, with its letter and its sign.
fn decimal_comma(line: &[u8], at: usize, digits: usize) -> (Fault, usize) {
    let is_part = |byte: &&u8| byte.is_ascii_digit() || **byte == b'.';
    let whole = line[..at].iter().rev().take_while(is_part).count();
    let mut start = at - whole;
    for is_next in [|byte: u8| byte == b'-' || byte == b'+', |byte: u8| byte.is_ascii_alphabetic()]
    {
        start -= usize::from(start > 0 && is_next(line[start - 1]));
    }
    let end = at + 1 + digits;
    let text = |part: &[u8]| String::from_utf8_lossy(part).to_ascii_uppercase();
    let (before, after) = (text(&line[start..at]), text(&line[at + 1..end]));
    let rest = line[end..].iter().take_while(|byte| b"0123456789.,".contains(byte)).count();
    let help = if rest > 0 {
        let all = text(&line[start..end + rest]).replace(',', "");
        format!("leave the comma out: {all}")
    } else if digits == 3 && whole > 0 {
        format!("write {before}.{after}; or {before}{after}, if thousands were meant")
    } else {
        format!("write {before}.{after}")
    };
    let end = end + rest;
    let fault = Fault::new(&rules::DECIMAL_COMMA, start as u32, end as u32, "a comma in a number");
    (fault.help(help), end - at)
}

/// A comment that holds another one, from its `(` at byte `start` on, and how many bytes of the
/// line it takes: up to the `)` that closes both, or else to the first.
pub(super) fn nested_comment(line: &[u8], start: usize) -> (Fault, usize) {
    let (mut depth, mut end, mut first) = (0, None, None);
    for (at, byte) in line.iter().enumerate().skip(start) {
        match byte {
            b'(' => depth += 1,
            b')' => depth -= 1,
            _ => continue,
        }
        if *byte == b')' {
            first = first.or(Some(at + 1));
            if depth == 0 {
                end = Some(at + 1);
                break;
            }
        }
    }
    let end = end.or(first).unwrap_or(line.len());
    let message = "a ( inside of a comment: controls differ in where the comment ends";
    let fault = Fault::new(&rules::NESTED_COMMENT, start as u32, end as u32, message);
    (fault.help("take the inner ( and ) out, or begin the comment by ;"), end - start)
}

/// A fault of a byte at which no item can begin; `words_end` is what has ended the words of the line.
pub(super) fn fault(line: &[u8], at: usize, words_end: Option<u8>) -> Fault {
    let rest = line.get(at..).unwrap_or_default();
    let byte = rest.first().copied().unwrap_or_default();
    let (at, to_end) = (at as u32, line.len() as u32);
    match byte {
        b'#' | b'[' | b']' | b'=' | b'<' | b'>' => Fault::new(
            &rules::EXPRESSION,
            at,
            at + 1,
            format!("{} belongs to no word and no parameter", char::from(byte)),
        )
        .help("a value follows a letter, as X[#1 + 2]; a parameter is set by #1 = 2"),
        b'$' => Fault::new(
            &rules::UNSUPPORTED_WORD,
            at,
            to_end,
            "lines that begin with $ are commands of a sender, not of a program",
        )
        .help("leave the line out"),
        b'0'..=b'9' if words_end == Some(b'*') => {
            Fault::new(&rules::BAD_NUMBER, at, to_end, "a number behind the * that ends the block")
                .help("what is to be multiplied stands in brackets, as X[2 * 3]")
        }
        b'0'..=b'9' | b'.' | b'-' | b'+' => {
            let end = at + number_length(rest) as u32;
            match word_before(line, at as usize) {
                Some(start) => {
                    let message = "a number goes on here that has ended already";
                    Fault::new(&rules::BAD_NUMBER, start, end, message)
                        .help("one sign at most, digits, one point at most")
                }
                None => Fault::new(&rules::BAD_NUMBER, at, end, "this number belongs to no letter")
                    .help("write one letter and one number a word, as X1.5"),
            }
        }
        b'/' => Fault::new(&rules::BAD_CHARACTER, at, at + 1, "a / behind the block's beginning")
            .help("it leaves out whole lines only; a quotient stands in brackets, as X[1 / 2]"),
        b')' => Fault::new(&rules::BAD_CHARACTER, at, at + 1, "a ) without a (")
            .help("a comment begins with ("),
        b'A'..=b'Z' | b'a'..=b'z' | b':' => {
            let after = if words_end == Some(b'%') { "%" } else { "the * that ends a block" };
            Fault::new(&rules::BAD_CHARACTER, at, to_end, format!("words after {after}"))
                .help("put them on a line of their own")
        }
        _ => {
            let count = rest.iter().take_while(|byte| **byte >= 0x80).count().max(1);
            let bytes = &rest[..count];
            let shown = String::from_utf8_lossy(bytes);
            let message = format!("{shown} belongs to no word");
            Fault::new(&rules::BAD_CHARACTER, at, at + count as u32, message).help(match byte {
                b'%' => "a % that begins or ends the text stands on a line of its own",
                _ => "comments stand in ( ) or after ;",
            })
        }
    }
}

/// How many bytes of a text look like those of a number, whether they are one or not.
pub(super) fn number_length(text: &[u8]) -> usize {
    text.iter().take_while(|byte| b"0123456789.+-".contains(byte)).count()
}

/// Where the word begins whose number goes on at a byte, if there is one.
fn word_before(line: &[u8], at: usize) -> Option<u32> {
    let is_number = |byte: &u8| b"0123456789.+- \t".contains(byte);
    let start = line.get(..at)?.iter().rposition(|byte| !is_number(byte))?;
    // Two letters are of a keyword, and no word.
    let is_letter = |at: usize| line.get(at).is_some_and(u8::is_ascii_alphabetic);
    (is_letter(start) && !(start > 0 && is_letter(start - 1))).then_some(start as u32)
}

/// A byte that no text holds.
pub(super) fn not_text(line: &[u8], at: usize) -> Fault {
    let byte = line.get(at).copied().unwrap_or_default();
    let message = format!("byte 0x{byte:02X} is no text: this is no NC program");
    let is_utf16 = line.starts_with(b"\xff\xfe") || line.starts_with(b"\xfe\xff");
    let help = if is_utf16 {
        "this looks like UTF-16: save the program as plain text (ASCII or UTF-8)"
    } else {
        "hand in the program as plain text (ASCII or UTF-8)"
    };
    Fault::new(&rules::NOT_TEXT, at as u32, at as u32 + 1, message).help(help)
}

/// Bytes that no text holds. The tab is a blank; line ends never get here.
pub(super) fn is_control(byte: u8) -> bool {
    (byte < 0x20 && byte != b'\t') || byte == 0x7f
}
