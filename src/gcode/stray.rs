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
        ' ' => format!("a {name} stands here for a plain blank"),
        _ => format!("a {name} stands here for {plain}"),
    };
    let fault = Fault::new(&rules::LOOK_ALIKE, from as u32, end as u32, message);
    let fault = match meant.trim() {
        "" => fault.help("type it anew in a plain text editor"),
        meant => fault.help(format!("write {meant}")),
    };
    Some((fault, end - at))
}

/// A fault of a text that begins with a comma, and how many bytes it spoils.
pub(super) fn comma(line: &[u8], at: usize) -> (Fault, usize) {
    let (before, after) = (&line[..at], &line[at + 1..]);
    let digits = after.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let is_in_number = before.last().is_some_and(u8::is_ascii_digit) && digits > 0;
    if is_in_number {
        return decimal_comma(line, at, digits);
    }
    let corner = after.first().filter(|byte| b"ACR".contains(&byte.to_ascii_uppercase()));
    let corner = corner.filter(|_| matches!(after.get(1), Some(b'0'..=b'9' | b'.' | b'-' | b'#')));
    if let Some(letter) = corner {
        let value = after[1..].iter().take_while(|byte| b"0123456789.-#".contains(byte)).count();
        let letter = char::from(*letter).to_ascii_uppercase();
        let what = match letter {
            'C' => "a chamfer between this line and the next",
            'R' => "a rounding between this line and the next",
            _ => "the angle of this line",
        };
        let end = at + 2 + value;
        let message = format!(",{letter} is not supported: {what}");
        let fault = Fault::new(&rules::UNSUPPORTED_WORD, at as u32, end as u32, message);
        return (fault.help("let the CAM program put out lines and arcs"), end - at);
    }
    let fault = Fault::new(
        &rules::BAD_CHARACTER,
        at as u32,
        at as u32 + 1,
        "a comma is no part of any word",
    );
    (fault.help("leave it out: words and arguments stand one after the other"), 1)
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
    let goes_on = line.get(end) == Some(&b'.');
    let help = if goes_on {
        format!("leave the comma out: {before}{after}")
    } else if digits == 3 {
        format!("write {before}.{after}; or {before}{after}, if thousands were meant")
    } else {
        format!("write {before}.{after}")
    };
    let rest = line[end..].iter().take_while(|byte| b"0123456789.,".contains(byte)).count();
    let fault = Fault::new(&rules::DECIMAL_COMMA, start as u32, end as u32, "a comma in a number");
    (fault.help(help), end + rest - at)
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
        b'0'..=b'9' | b'.' | b'-' | b'+' => {
            let end = rest.iter().take_while(|byte| b"0123456789.+-".contains(byte));
            let end = at + end.count() as u32;
            Fault::new(&rules::BAD_NUMBER, at, end, "this number belongs to no letter")
                .help("write one letter and one number a word, as X1.5")
        }
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
            let message = format!("{shown:?} belongs to no word");
            Fault::new(&rules::BAD_CHARACTER, at, at + count as u32, message)
                .help("comments stand in ( ) or after ;")
        }
    }
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
