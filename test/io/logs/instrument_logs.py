"""Logs of ship's instruments as the tests write them: the encoders of io/telegrams, and small ones of formats that
these do not have."""

from __future__ import annotations

import math
import struct

from cable_sim_ros.tools.telegrams import lci90i, pashr, psxn, tss1
from cable_sim_ros.tools.telegrams.fields import Motion, exclusive_or, sentence

SECOND = 1_000_000_000
MIDNIGHT = 1_406_851_200 * SECOND  # 2014-08-01T00:00:00Z
DAY = 86_400 * SECOND


def iso(time: int) -> bytes:
    """The stamp of OpenRVDAS, and the blank behind it."""
    days, rest = divmod(time - MIDNIGHT, DAY)
    seconds = rest // SECOND
    clock = f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}.{rest % SECOND // 1000:06d}"
    return f"2014-08-{1 + days:02d}T{clock}Z ".encode()


def hhmmss(time: int) -> str:
    """Time of day of a sentence."""
    rest = time % DAY
    seconds = rest // SECOND
    return f"{seconds // 3600:02d}{seconds // 60 % 60:02d}{seconds % 60:02d}.{rest % SECOND // 10_000_000:02d}"


def gga(time: int) -> bytes:
    """22 deg 0.110899 min south, 17 deg 56.359432 min west."""
    return sentence(f"INGGA,{hhmmss(time)},2200.110899,S,01756.359432,W,1,12,0.7,-2.76,M,4.67,M,,")


def zda(time: int) -> bytes:
    """In August 2014."""
    return sentence(f"INZDA,{hhmmss(time)},{1 + (time - MIDNIGHT) // DAY:02d},08,2014,,")


def rmc(time: int) -> bytes:
    """In August 2014."""
    day = 1 + (time - MIDNIGHT) // DAY
    return sentence(f"INRMC,{hhmmss(time)},A,2200.110899,S,01756.359432,W,9.1,215.11,{day:02d}0814,24.7,W,A")


def motion(k: int, time: int = 0) -> Motion:
    """Roll k/10 deg, pitch 1 deg, yaw to 218.26 deg of heading, heave k/100 m."""
    angles = math.radians(0.1 * k), math.radians(1.0), math.radians(90.0 - 218.26)
    return Motion(time, *angles, 0.01 * k, 0.383, -0.5)


def seapath(seconds: int, start: int = MIDNIGHT, stamped: bool = True) -> bytes:
    """Bursts of a Seapath, one a second: position, heading, quality, motion."""
    lines = []
    for k in range(seconds):
        at = start + k * SECOND
        others = [sentence("INVTG,215.11,T,239.79,M,9.1,N,16.9,K,A"), sentence(f"INHDT,{218 + 0.01 * k:.2f},T")]
        quality = [sentence("PSXN,20,1,0,0,0"), sentence("PSXN,22,0.03,-0.80")]
        for line in (zda(at), gga(at), *others, rmc(at), *quality, psxn.encode(motion(k))):
            lines.append((iso(at + 300_000_000) if stamped else b"") + line)
    return b"".join(lines)


def winch(count: int, name: str = "STBD TRAWL", start: int = MIDNIGHT, ahead: int = 1718 * SECOND) -> bytes:
    """Telegrams of a winch display, 20 a second: k lbf, 6 m/min, -34 + k/10 m; its clock runs ahead of the logger."""
    lines = []
    for k in range(count):
        at = start + k * 50_000_000
        values = lci90i.Winch(at + ahead, k * 4.4482216152605, 0.1, -34.0 + 0.1 * k)
        lines.append(iso(at) + lci90i.encode(values, lci90i.Form(2, name)))
    return b"".join(lines)


def tss(count: int) -> bytes:
    """TSS1 without stamps."""
    return b"".join(tss1.encode(motion(k)) for k in range(count))


def applanix(times: list[int]) -> bytes:
    """PASHR without stamps."""
    return b"".join(pashr.encode(motion(k, time)) for k, time in enumerate(times))


def buoy(hours: int, samples: int = 40) -> bytes:
    """A wave buoy: statistics, a spectrum, displacements; heave k/100, north k/50, east -k/100 m."""
    lines = []
    for hour in range(hours):
        head = f"20140801,{hour:02d}0059,05981,buoyID,,"
        statistics = sentence(f"TSPWA,{head},144,1.02,7.4,2.92,1.58,9.6,2.01,11.2,7.8,14.3,14.0,1.72,180.1,42.2")
        spectrum = sentence(f"TSPNA,{head},3,0.030,0.005,5.486E-05,1.277E-04,2.021E-04")
        rows = ",".join(f"{0.01 * k:.2f},{0.02 * k:.2f},{-0.01 * k:.2f}" for k in range(samples))
        series = sentence(f"TSPHA,{head},{samples},60.164,0.781,0,{rows}")
        for second, line in enumerate((b"[wavss]:Instrument Started\r\n", statistics, spectrum, series)):
            lines.append(f"2014/08/01 {hour:02d}:23:{second:02d}.260 ".encode() + line)
    return b"".join(lines)


def profiler(count: int) -> bytes:
    """The winch of a profiler, 16 rows a second."""
    heading = "Timestamp (s)\tDepth (dbar)\tSuspect Timestamp\tEncoder Counts\tStatus\tRope On Drum(m)\r\n"
    rows = (
        f"{1397773523 + k / 16:.4f}\t{0.5 + 0.1 * k:.3f}\t{'yn'[k > 0]}\t{-1494303 - k}\t0000F000\t{9.55 + k:.2f}\r\n"
        for k in range(count)
    )
    return ("Source File: D:\\x.WC\r\nDevice: WM\r\nStart Date: 04/17/2014\r\n" + heading + "".join(rows)).encode()


def gx3(count: int, ticks: int = 100_000, step: int = 6250) -> bytes:
    """Records 0xCB of a 3DM-GX3, 10 a second: acceleration (k/8, 0, -1) g."""
    records = []
    for k in range(count):
        body = struct.pack(
            ">B9fI", 0xCB, k / 8, 0.0, -1.0, 0.25, -0.5, 0.0, 0.5, 0.125, 0.0, (ticks + k * step) % 2**32
        )
        records.append(body + struct.pack(">H", sum(body) & 0xFFFF))
    return b"".join(records)


def fdchp(count: int) -> bytes:
    """Records of a flux package over midnight of 2014-11-30, 10 a second: roll k/64 rad."""
    records = []
    for k in range(count):
        day, clock = ((11, 30), (23, 59, 59)) if k < 10 else ((12, 1), (0, 0, (k - 10) // 10))
        floats = 0.25, 0.0, 0.0, 0.0, 0.0, -1.0, k / 64, 0.5, 1.5
        wind = (-125, 0, 32767, 32767)
        records.append(struct.pack(">H5BH3hH9fBB", 2014, *day, *clock, 100 * (k % 10), *wind, *floats, 0, 0))
    return b"".join(records)


def n2k(count: int) -> bytes:
    """Raw form of canboat: attitude and heave of source 27, attitude of source 52; roll k/1000 rad, heave k/100 m."""
    lines = []
    for k in range(count):
        attitude = struct.pack("<Bhhhb", 0, 0x7FFF, 145, 10 * k, -1).hex(",")
        heave = struct.pack("<BhBBBBB", 0, k, *b"\xff\xff\xff\x7f\xfd").hex(",")
        stamp = f"2014-08-01T00:00:{k / 10:06.3f}Z"
        lines += [f"{stamp},3,127257,{source},255,8,{attitude}\n" for source in (27, 52)]
        lines.append(f"{stamp},3,127252,27,255,8,{heave}\n")
    return "".join(lines).encode()


def checked(body: bytes) -> bytes:
    """$body*hh, whatever is in it."""
    return b"$%s*%02X\r\n" % (body, exclusive_or(body))
