"""The pointing model in force: the configured one, or what a person has put in its place.

What a person puts in force is written into the state directory, so that it outlives the process, and is read back
from there: `status` names it, `clear` ends it and the configured one is in force again.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from clockdrive.errors import Refused, StateError
from clockdrive.session import Session
from clockdrive.telescope_files import stem
from pointing.errors import PointingError

if TYPE_CHECKING:
    from clockdrive.run_report import RunReport
    from pointing.model.fitted import Fit
    from pointing.model.pointing_model import PointingModel

    Given = Fit | PointingModel | RunReport | str | Path | None

NAME = "pointing model"
"""Of the correction, in `status`."""
_KEPT, _NONE = "kept", "none"
_SAME = math.radians(1e-3 / 3600.0)  # of registers, which are whole milliarcseconds


class ModelInForce:
    """Puts pointing models in force.

    Parameters
    ----------
    session : Session
        Whose telescope; as it is opened, with the configured model.
    directory : Path
        The state directory.
    """

    def __init__(self, session: Session, directory: Path) -> None:
        self._session = session
        self._configured = session.planner.mount.model
        self._path = directory / f"{stem('model', session.store.telescope)}.mod"

    def take_up(self) -> None:
        """Put in force what a person has put in force before.

        Raises
        ------
        StateError
            Its file is no model of this mount.
        """
        which = self._session.store.model()
        if which == _NONE:
            self._set(None)
        elif which == _KEPT and not self._path.exists():
            self._session.store.clear_model()
            self._session.note(NAME, f"{self._path} is gone: the configured one is in force")
        elif which == _KEPT:
            try:
                self._set(self._read(self._path))
            except PointingError as error:
                text = f"the pointing model in force, {self._path}, cannot be read: {error}"
                raise StateError(f"{text}; delete it, and the configured one is in force again") from error

    @property
    def by_hand(self) -> bool:
        """Whether a person has put the model that is in force in place of the configured one."""
        return self._session.store.model() is not None

    def use(self, model: "Given") -> None:
        """Point with another model, or with none, from now on.

        Raises
        ------
        Refused
            The telescope is not at rest: the target that it tracks would be elsewhere. Or the model comes on top of
            other mount registers than are in force, which would count twice.
        PointingError
            It is no model of this mount, or has a term of one's own, which no file keeps.
        StateError
            It cannot be remembered; what was in force goes on.
        """
        self._require_rest()
        self._require_registers(model)
        store, now = self._session.store, self._session.clock.now()
        if model is None:
            store.record_model(_NONE, now)
            self._set(None)
            self._path.unlink(missing_ok=True)
        else:
            fresh = self._path.with_suffix(".new")  # the one that was in force is there until this one is good
            try:
                self._write(model, fresh)
                self._read(fresh)
                store.record_model(_KEPT, now)
                fresh.replace(self._path)
            finally:
                fresh.unlink(missing_ok=True)
            self._set(self._read(self._path))
        self._told()

    def clear(self) -> None:
        """Let the configured model be in force again.

        Raises
        ------
        Refused
            The telescope is not at rest.
        """
        self._require_rest()
        self._session.store.clear_model()
        self._set(self._configured)
        self._path.unlink(missing_ok=True)
        self._told()

    def _require_rest(self) -> None:
        session = self._session
        session.require_free(parked=True)
        if session.pursuit is not None:
            raise Refused(f"the telescope tracks {session.pursuit.target.name}: `stop` it, then change the model")

    def _require_registers(self, model: "Given") -> None:
        fitted = getattr(model, "registers", None)  # of a report alone; a file does not tell
        mount = self._session.planner.mount
        if fitted is not None and math.dist(fitted, (mount.x, mount.y)) > _SAME:
            on, here = (
                " and ".join(f"{math.degrees(each) * 3600.0:.1f}″" for each in pair)
                for pair in (fitted, (mount.x, mount.y))
            )
            raise Refused(
                f"the model was fitted on top of mount registers of {on}, and {here} are in force: fit the run again"
            )

    def _write(self, model: "Fit | PointingModel | RunReport | str | Path", path: Path) -> None:
        """Write a model in TPOINT's form, with all that is known of it."""
        from pointing.model.fitted import Fit  # noqa: PLC0415 - as in `_read`
        from pointing.model.model_file import read_model_file, write_model_file  # noqa: PLC0415 - as in `_read`
        from pointing.model.pointing_model import PointingModel  # noqa: PLC0415 - likewise
        from pointing.model.saved_model import save, save_model  # noqa: PLC0415 - likewise

        if isinstance(model, str | Path):
            self._read(Path(model))  # refused under its own name
            write_model_file(read_model_file(model), path)
            return
        found = model if isinstance(model, Fit | PointingModel) else model.fit
        itself = found.model if isinstance(found, Fit) else found
        replace(self._session.planner.mount, model=itself)  # a file would tell neither kind nor latitude
        if isinstance(found, Fit):
            save(found, path)
        else:
            save_model(found, path)

    def _read(self, path: Path) -> "PointingModel":
        from pointing.model.model_on_file import ModelOnFile  # noqa: PLC0415 - only where there is one

        mount = self._session.planner.mount
        return ModelOnFile.read(path, mount.type.kind, mount.latitude)

    def _set(self, model: "PointingModel | None") -> None:
        planner = self._session.planner
        planner.mount = replace(planner.mount, model=model)

    def _told(self) -> None:
        model = self._session.planner.mount.model
        self._session.history.forget("another pointing model was put in force after it")
        self._session.note(NAME, "none" if model is None else " ".join(each.name for each in model.terms))
