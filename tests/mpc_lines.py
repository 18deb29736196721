"""Lines of elements in the Minor Planet Center's columns, made here; the bodies' numbers are close to real ones."""


def asteroid(
    packed, epoch="K25BL", anomaly=188.70269, argument=73.27343, node=80.25221, inclination=10.58780, e=0.0794013,
    n=0.21424651, a=2.7660512, name="",
):  # fmt: skip
    """Return a line as in MPCORB."""
    return (
        f"{packed:<7}  3.34  0.15 {epoch} {anomaly:9.5f}  {argument:9.5f}  {node:9.5f}  {inclination:9.5f}  "
        f"{e:9.7f} {n:11.8f} {a:11.7f}  0 E2025-V47  7330 123 1801-2025 0.80 M-v 30k Pan        0000 "
        f"{name:<28}20251019"
    )


def comet(packed, perihelion, q, e, argument=130.5422, node=282.6728, inclination=89.4150, epoch="20240916", name=""):
    """Return a line as in CometEls; `perihelion` is a year, month and day."""
    year, month, day = perihelion
    return (
        f"{packed:<12}  {year:4d} {month:02d} {day:07.4f} {q:9.6f}  {e:8.6f}  {argument:8.4f}  {node:8.4f}  "
        f"{inclination:8.4f}  {epoch:8}  -2.0  4.0  {name:<56} MPC106342"
    )


CERES = asteroid("00001", name="     (1) Ceres")
HALE_BOPP = comet("    CJ95O010", (1997, 3, 29.6169), 0.905195, 0.995047, name="C/1995 O1 (Hale-Bopp)")
MPCORB = "\n".join(
    [
        "MINOR PLANET CENTER ORBIT DATABASE (MPCORB)",
        "",
        "Des'n     H     G   Epoch     M        Peri.      Node       Incl.       e            n           a",
        "-" * 160,
        CERES,
        asteroid("00002", name="     (2) Pallas", e=0.2306), "",
        asteroid("A0345"),
        asteroid("K15X33X", name="2015 XX33"),
        asteroid("PLS2040", name="2040 P-L"),
        "",
    ]
)  # fmt: skip
COMETS = "\n".join(
    [
        comet("0001P", (2061, 7, 27.9437), 0.571970, 0.967943, 111.3329, 58.4201, 162.2627, "20251121", "1P/Halley"),
        HALE_BOPP,
        comet("    CK01X050", (2026, 1, 12.25), 1.034, 1.0, 10.0, 200.0, 63.0, "", "C/2001 X5 (Parabola)"),
        comet("0073P      b", (2027, 12, 23.1), 0.92, 0.699, epoch="20251121", name="73P-B/Schwassmann-Wachmann"),
        comet("0073P      c", (2027, 12, 24.1), 0.92, 0.699, epoch="20251121", name="73P-C/Schwassmann-Wachmann"),
        "",
    ]
)
