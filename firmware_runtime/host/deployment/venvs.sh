# Virtual environments in $home.
#
# Each is a folder venv.XXXXXX, a version of the program; the link `venv` names the one in use,
# `previous` the one before. A link is replaced in one step, and only by a program that is whole on
# the disk: so there is never half a program, also not after a power cut. What was sent of it is
# listed in its file `manifest`, and what was made of that here in `manifest.made`.

# What rich depends on to draw source code and Markdown, which this program does not: a third of all.
without_bytecode='/site-packages/(pygments|markdown_it|mdurl)/'

finish_venv() { # make $1 of what was sent: with python $2, and bytecode unless $3 is yes
	mkdir -p "$1/bin" && ln -sfn "$2" "$1/bin/python" && ln -sfn python "$1/bin/python3" || return
	[ "$3" = yes ] || "$1/bin/python" -I -S -m compileall -qq -j 0 -x "$without_bytecode" "$1/lib" || true
	(
		cd "$1" || exit
		[ "$3" = yes ] || find . -name '*.pyc' -exec sha256sum {} + >manifest.made || exit
		[ ! -e manifest.sent.sig ] || mv manifest.sent.sig manifest.sig || exit
		touch manifest.sent && sync -f . && mv manifest.sent manifest && sync -f .
	)
}

is_as_sent() { # whether $1 has the files of its list, as they were made, and no others
	(
		cd "$1" && sha256sum --check --strict --quiet manifest.sent >/dev/null 2>&1 || exit
		found=$(find . ! -type d ! -path ./manifest.sent ! -path ./manifest.sent.sig | LC_ALL=C sort)
		[ "$found" = "$(cut -c 67- manifest.sent | LC_ALL=C sort)" ]
	)
}

is_whole() { # whether each file of $1 is there, as it was made
	(
		cd "$1" && [ -s manifest ] || exit
		cat manifest manifest.made 2>/dev/null | sha256sum --check --strict --quiet
	) >/dev/null 2>&1
}

sound_venv() { # $1, or $2 if that is not whole
	# One that was made before there were manifests has none. A damaged one makes no robot safe, and a
	# shell takes an empty file for a program that succeeds.
	if [ -s "$1/bin/firmware-runtime" ] && { [ ! -e "$1/manifest" ] || is_whole "$1"; }; then
		echo "$1"
	else
		echo "$2"
	fi
}

safe_venv() { # as sound_venv, of a program that runs: its interpreter may have gone
	each=$(sound_venv "$1" "$2")
	if "$each/bin/firmware-runtime" --version >/dev/null 2>&1; then echo "$each"; else echo "$2"; fi
}

use_venv() { # the link `venv` names $1 from now on
	ln -sfn "$1" "$home/venv.link" && sync -f "$home" &&
		mv -T "$home/venv.link" "$home/venv" && sync -f "$home"
}

use_new_venv() { # as use_venv, and the one in use becomes `previous`
	if [ -L "$home/venv" ]; then
		ln -sfn "$(readlink "$home/venv")" "$home/previous" || return
	fi
	use_venv "$1"
}

discard_venv() { # $1, unless it is in use or was before
	case $1 in
	"$(readlink "$home/venv")" | "$(readlink "$home/previous")") ;;
	*) rm -rf "$1" ;;
	esac
}

remove_other_venvs() { # all but those in use and before; what is young may be another's, under way
	[ -z "$earlier" ] || discard_venv "$earlier"
	find "$home" -maxdepth 1 -name 'venv.??????' -mmin +60 | while read -r each; do
		discard_venv "$each"
	done
}

list_versions() { # of programs that are whole: version, folder, since when, and its place
	for each in "$home"/venv.??????; do
		case $each in
		"$(readlink "$home/venv")") place=in-use ;;
		"$(readlink "$home/previous")") place=before ;;
		*) place=beside ;;
		esac
		[ "$place" != beside ] || [ -e "$each/manifest" ] || continue
		echo "$(version_of "$each") ${each##*/} $(date -u -r "$each" +%Y-%m-%dT%H:%M:%SZ) $place"
	done
}

version_of() { # of the program in $1
	version=unknown
	for metadata in "$1"/lib/python3*/site-packages/firmware_runtime-*.dist-info; do
		[ ! -e "$metadata" ] || version=${metadata##*/firmware_runtime-}
	done
	echo "${version%.dist-info}"
}
