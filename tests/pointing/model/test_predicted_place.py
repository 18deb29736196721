"""A fit predicts places with units, from the frames of astropy too, and maps how sure it is."""

import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import AltAz, EarthLocation, HADec, SkyCoord
from astropy.time import Time
from simulated_runs import TRUTH, simulated_run, star_vectors

from pointing.errors import PointingError
from pointing.model.error_map import error_map
from pointing.model.fit import fit
from pointing.model.predicted_place import predict
from pointing.mount import POSTURES

ARCSEC = np.radians(1.0 / 3600.0)
MOUNTS = ("fork", "german", "altazimuth")


def fitted(mount, latitude_deg=-35.0, seed=21, noise_arcsec=0.0, n=80):
    rng = np.random.default_rng(seed)
    run = simulated_run(mount, latitude_deg, TRUTH[mount], n, rng, noise_arcsec=noise_arcsec).run
    return fit(run, " ".join(TRUTH[mount]))


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize("posture", POSTURES)
def test_the_telescope_put_where_predicted_sees_the_star(mount, posture):
    found = fitted(mount)
    lon, lat = np.linspace(-60.0, 60.0, 7) * u.deg, np.linspace(-50.0, 40.0, 7) * u.deg
    place = found.predict(lon, lat, posture=posture)
    axes = place.axis1.to_value("rad"), place.axis2.to_value("rad")
    seen = star_vectors(mount, found.model.latitude, TRUTH[mount], *axes)
    lon, lat = lon.to_value("rad"), lat.to_value("rad")
    star = np.array((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    worst = np.max(np.linalg.norm(seen - star, axis=0)) / ARCSEC
    print(f"{mount}: {worst:.1e}″")
    assert worst < 1e-3  # what the fit of a run without noise leaves
    assert np.all((np.cos(axes[1]) < 0.0) == (posture == "beyond"))
    assert place.sigma.unit == u.arcsec


def test_the_frames_of_astropy_and_plain_angles_give_the_same_place():
    site = EarthLocation.from_geodetic(20.0, -35.0, 0.0)
    at = Time("2026-03-01T20:00:00")
    for mount in ("fork", "altazimuth"):
        found = fitted(mount)
        hadec = SkyCoord(HADec(ha=2.0 * u.hourangle, dec=-20.0 * u.deg, location=site, obstime=at))
        s, c, sd, cd = np.sin(-35.0 * u.deg), np.cos(-35.0 * u.deg), np.sin(-20.0 * u.deg), np.cos(-20.0 * u.deg)
        h = 30.0 * u.deg
        elevation = np.arcsin(s * sd + c * cd * np.cos(h))
        azimuth = np.arctan2(-cd * np.sin(h), sd * c - cd * np.cos(h) * s)
        altaz = SkyCoord(AltAz(az=azimuth, alt=elevation, location=site, obstime=at))
        own = (azimuth, elevation) if mount == "altazimuth" else (h, -20.0 * u.deg)
        places = [predict(found, hadec), predict(found, altaz), predict(found, *own)]
        for place in places[1:]:
            apart = (place.axis1 - places[0].axis1).to_value("deg") % 360.0
            assert min(apart, 360.0 - apart) * 3600.0 < 1e-6
            assert abs(place.axis2 - places[0].axis2).to_value("arcsec") < 1e-6


def test_shapes_are_kept_and_broadcast():
    place = predict(fitted("fork"), 10.0 * u.deg, [[1.0], [2.0]] * u.deg)
    assert place.axis1.shape == place.sigma.shape == (2, 1)
    assert predict(fitted("fork"), 10.0 * u.deg, 20.0 * u.deg).axis2.shape == ()


def test_offsets_are_what_is_added_to_the_reading_to_find_the_star():
    place = predict(fitted("altazimuth"), 100.0 * u.deg, 30.0 * u.deg)
    assert (place.axis1 + place.offset1).to_value("deg") == pytest.approx(100.0, abs=1e-9)
    assert (place.axis2 + place.offset2).to_value("deg") == pytest.approx(30.0, abs=1e-9)


def test_a_notebook_shows_a_row_a_place_with_units():
    html = predict(fitted("fork"), 10.0 * u.deg, [1.0, 2.0] * u.deg)._repr_html_()
    assert html.count("<tr>") == 3
    assert "axis1, deg" in html
    assert "sigma, arcsec" in html


def test_other_frames_and_plain_numbers_are_refused_with_what_to_give():
    found = fitted("fork")
    with pytest.raises(PointingError, match="frame AltAz or HADec"):
        predict(found, SkyCoord(1.0 * u.deg, 2.0 * u.deg))
    with pytest.raises(PointingError, match="angles with a unit"):
        predict(found, 1.0, 2.0)
    with pytest.raises(PointingError, match="no posture 'flipped': possible are normal and beyond"):
        predict(found, 1.0 * u.deg, 2.0 * u.deg, posture="flipped")


@pytest.mark.parametrize("mount", MOUNTS)
def test_the_map_says_by_how_much_fits_of_other_nights_differ(mount):
    """The model's place against the true one, over 40 fits of fresh noise, at three places of the map."""
    latitude = -35.0
    shown = error_map(fitted(mount, latitude, 100, 3.0), step_deg=15.0, lowest_deg=30.0)
    assert shown.sigma.shape == (len(shown.elevation), len(shown.azimuth))
    squares = []
    for seed in range(101, 141):
        found = fitted(mount, latitude, seed, 3.0)
        own = error_map(found, step_deg=15.0, lowest_deg=30.0)
        for i, j in ((0, 2), (1, 20), (2, 9)):
            azimuth, elevation = own.azimuth[j], own.elevation[i]
            place = SkyCoord(az=azimuth, alt=elevation, frame="altaz")
            beyond = mount == "german" and np.sin(azimuth.to_value("rad")) > 0.0
            at = predict(found, place, posture="beyond" if beyond else "normal")
            axes = at.axis1.to_value("rad"), at.axis2.to_value("rad")
            true = star_vectors(mount, np.radians(latitude), TRUTH[mount], *(np.array([a]) for a in axes))[:, 0]
            lon, lat = found.model.star(*map(float, axes))
            said = np.array((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
            squares.append((np.linalg.norm(true - said) / ARCSEC / own.sigma[i, j].to_value("arcsec")) ** 2)
    print(f"{mount}: {shown!r}; mean square of error / σ {np.mean(squares):.2f}")
    assert 0.6 < np.mean(squares) < 1.6


def test_the_map_is_a_table_and_a_notebook_shows_it():
    shown = error_map(fitted("fork", noise_arcsec=2.0), step_deg=10.0)
    table = shown.to_table()
    assert len(table) == shown.sigma.size
    assert table["sigma"].unit == u.arcsec
    worst = shown.worst
    assert worst[0] == shown.sigma.max()
    assert shown.sigma.min() <= shown.median <= worst[0]
    html = shown._repr_html_()
    assert html.count("E ") >= 6
    assert f"{worst[0].to_value('arcsec'):.2f}″" in html


@pytest.mark.parametrize(("options", "text"), [({"step_deg": 0.0}, "a step of 0°"), ({"lowest_deg": 90.0}, "90°")])
def test_impossible_maps_are_refused(options, text):
    with pytest.raises(PointingError, match=text):
        error_map(fitted("fork"), **options)
