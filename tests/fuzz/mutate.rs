//! Structured mutations of texts: numbers, words and lines are replaced by values that often break readers.

/// One change: its kind, its place and its operand. Places are taken modulo the number of pieces, so any three numbers are valid.
pub(crate) type Mutation = (u8, u32, u32);

/// Unusual values for numbers and words.
const ODD: [&str; 40] = [
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "1e-3",
    "1e7",
    "1.1e7",
    "-1e308",
    "1e308",
    "1e309",
    "5e-324",
    "1e200",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775808",
    "0x10",
    "1_000",
    "1,5",
    "\"\"",
    "''",
    "[]",
    "{}",
    "[[]]",
    "true",
    "null",
    "none",
    "\u{1b}[31m",
    "\u{7}",
    "\u{202e}ü",
    "\"a\nb\"",
    "../../x",
];

/// Longest mutated text, bytes.
const MAX_LENGTH: usize = 200_000;

/// The pieces of a text: runs of word characters, runs of blanks, every other character by itself.
fn pieces(text: &str) -> Vec<&str> {
    let kind = |c: char| match c {
        '\n' => 0,
        c if c.is_whitespace() => 1,
        c if c.is_alphanumeric() || "+-._@".contains(c) => 2,
        _ => 3,
    };
    let mut out = Vec::new();
    let mut start = 0;
    let mut last = None;
    for (i, c) in text.char_indices() {
        if last.is_some_and(|last| last != kind(c) || last % 3 == 0) {
            out.push(&text[start..i]);
            start = i;
        }
        last = Some(kind(c));
    }
    out.push(&text[start..]);
    out
}

/// `text` after one change; words and lines are also taken from `others`.
pub(crate) fn mutate(text: &str, others: &[String], (what, a, b): Mutation) -> String {
    let (a, b) = (a as usize, b as usize);
    let other = &others[b % others.len()];
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let mut tokens = pieces(text);
    let word = |p: &&str| p.chars().all(|c| c.is_alphanumeric() || "+-._@".contains(c));
    let words: Vec<usize> = (0..tokens.len()).filter(|&i| word(&tokens[i])).collect();
    if lines.is_empty() || words.is_empty() {
        return ODD[b % ODD.len()].to_owned();
    }
    let at = words[a % words.len()];
    let line = a % lines.len();
    let scaled;
    let mut out = match what {
        0..=2 => {
            tokens[at] = ODD[b % ODD.len()];
            tokens.concat()
        }
        3 | 4 => {
            // A number that stays one, so that what is read goes on to be used: of another size, or the next one to it.
            let numbers: Vec<usize> = words.iter().copied().filter(|&i| tokens[i].parse::<f64>().is_ok()).collect();
            let at = if numbers.is_empty() { at } else { numbers[a % numbers.len()] };
            let factor = [-1.0, 0.0, 0.5, 0.9, 0.999, 1.001, 1.1, 2.0, 10.0, 1e-3, 1e3, 1e6][b % 12];
            scaled = match (tokens[at].parse::<i64>(), tokens[at].parse::<f64>()) {
                (Ok(n), _) if what == 3 => n.saturating_add([-2, -1, 1, 2][b % 4]).to_string(),
                (_, Ok(x)) => (x * factor).to_string(),
                _ => "7".to_owned(),
            };
            tokens[at] = &scaled;
            tokens.concat()
        }
        5 => {
            tokens[at] = tokens[words[b % words.len()]];
            tokens.concat()
        }
        6 => {
            let theirs = pieces(other);
            tokens[at] = theirs[a.wrapping_mul(31) % theirs.len()];
            tokens.concat()
        }
        7 => {
            tokens.remove(a % tokens.len());
            tokens.concat()
        }
        8 => {
            tokens.insert(a % tokens.len(), ODD[b % ODD.len()]);
            tokens.concat()
        }
        9 => {
            lines.remove(line);
            lines.concat()
        }
        10 => {
            lines.swap(line, b % text.split_inclusive('\n').count());
            lines.concat()
        }
        11 => {
            let again = lines[line].repeat(2 + b % 40);
            lines[line] = &again;
            lines.concat()
        }
        12 => {
            let theirs: Vec<&str> = other.split_inclusive('\n').collect();
            lines.insert(line, theirs.get(a.wrapping_mul(31) % theirs.len().max(1)).copied().unwrap_or("\n"));
            lines.concat()
        }
        13 => text.chars().take(b % (1 + text.len())).collect(),
        14 => {
            // A word or a list grown long.
            let again = tokens[at].repeat(2 + b % 2000);
            tokens[at] = &again;
            tokens.concat()
        }
        16.. => {
            // Bytes of a number, in either order, that often breaks readers.
            let value: u64 = [0, 1, 0x7f, 0xff, 0x7fff_ffff, 0xffff_ffff, 0x7fc0_0000, u64::MAX][b % 8];
            let mut bytes = value.to_le_bytes()[..1 << (b / 8 % 4)].to_vec();
            if b / 32 % 2 == 1 {
                bytes.reverse();
            }
            let mut chars: Vec<char> = text.chars().collect();
            // The header of a binary file is short, so half of the changes are there.
            let reach = if b / 64 % 2 == 1 { chars.len().min(400) } else { chars.len() };
            let place = a % reach;
            chars[place..].iter_mut().zip(bytes).for_each(|(c, byte)| *c = char::from(byte));
            chars.into_iter().collect()
        }
        _ => {
            let odd = char::from_u32(b as u32 % 0x300).unwrap_or('\0');
            let mut chars: Vec<char> = text.chars().collect();
            let place = a % chars.len();
            chars[place] = odd;
            chars.into_iter().collect()
        }
    };
    if out.len() > MAX_LENGTH {
        out = out.chars().take(MAX_LENGTH / 4).collect();
    }
    out
}
