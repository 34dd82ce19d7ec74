"""Whatever the bytes, reading ends in a `Dataset` or in a `WorkbenchError`; a preview never raises."""

from contextlib import suppress

from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.base.errors import WorkbenchError
from workbench.data.readers import preview, read_measurements
from workbench.data.readers.columns_option import parse_columns

quick = settings(max_examples=150)

SOUND = b"q1[deg],q2[deg],x[mm],y[mm],z[mm],qw,qx,qy,qz,session,exclude\n"
SOUND += b"1.5,2,3,4,5,1,0,0,0,a,false\n-1.5,2e1,3,4,5,0,1,0,0,b,true\n" * 3
MAGICS = [b"", b"PK\x03\x04xl/[Content_Types].xml", b"PAR1", b"MATLAB 5.0 MAT-file", b"\xff\xfe",
          b"\xef\xbb\xbf", b"# ", b"Format Version,1.23\n"]  # fmt: skip
CELLS = ["", "1", "1,5", "1.5", "-", "nan", "inf", "abc", "q1[deg]", "x[mm]", "y", "z[foo]", "rx[rad]", "#",
         '"', "true"]  # fmt: skip


def read_or_refuse(path, **options):
    shown = preview(path, **options)
    try:
        read_measurements(path, **options)
    except WorkbenchError:
        assert shown.problems
    else:
        assert not shown.problems


@settings(max_examples=30)
@given(magic=st.sampled_from(MAGICS), body=st.binary(max_size=300))
def test_any_bytes(tmp_path, magic, body):
    path = tmp_path / "thing"
    path.write_bytes(magic + body)
    read_or_refuse(path)


@quick
@given(
    place=st.integers(0, len(SOUND) - 1),
    cut=st.integers(0, 40),
    put=st.sampled_from([b"", b",", b";", b"\t", b"\n", b'"', b"\x00", b"1e400", b"#", b"\xe9", b"q1[deg]"]),
)
def test_a_sound_file_with_a_wound(tmp_path, place, cut, put):
    path = tmp_path / "rows.csv"
    path.write_bytes(SOUND[:place] + put + SOUND[place + cut :])
    read_or_refuse(path, joints=2)


@quick
@given(
    rows=st.lists(st.lists(st.sampled_from(CELLS), min_size=1, max_size=7), min_size=1, max_size=6),
    separator=st.sampled_from([",", ";", "\t", " "]),
    columns=st.sampled_from([None, "q1[deg],x[mm],y[mm],z[mm]", "q[deg],xyz[mm]", "q1[deg]=abc"]),
)
def test_any_table(tmp_path, rows, separator, columns):
    path = tmp_path / "rows.csv"
    path.write_text("\n".join(separator.join(row) for row in rows))
    read_or_refuse(path, columns=columns)


@quick
@given(st.text("q12[]|=,;.…- xyzdegmrowcolumn", max_size=30))
def test_any_columns_option(text):
    with suppress(WorkbenchError):
        parse_columns(text)
