#!/usr/bin/env bash
# Completion as bash asks for it: completion_test.sh FILE
set -uo pipefail
source "$1" || exit 1
failed=0
# completes 'words on the line' 'what must be offered' ['what must not']
completes() {
    COMP_WORDS=($1)
    [[ $1 == *' ' ]] && COMP_WORDS+=('')
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
    COMPREPLY=()
    _lodestone
    for each in $2; do
        [[ " ${COMPREPLY[*]} " == *" $each "* ]] || { echo "'$1' offers '${COMPREPLY[*]}', not '$each'"; failed=1; }
    done
    for each in ${3:-}; do
        [[ " ${COMPREPLY[*]} " != *" $each "* ]] || { echo "'$1' offers '$each'"; failed=1; }
    done
}
cd "$(dirname "$0")" || exit 1
completes 'lodestone ' 'bake extract render verify' 'completion_test.sh'
completes 'lodestone ba' 'bake' 'bench'
completes 'lodestone --v' '--version --verbose'
completes 'lodestone bake --res' '--resolution --resume' '--report'
completes 'lodestone bake --resolution ' '65 129' '66'
completes 'lodestone -q extract a.lode --backend ' 'lod vgi' 'full'
completes 'lodestone bake comp' 'completion_test.sh'
completes 'lodestone bake a.ply -o comp' 'completion_test.sh'
completes 'lodestone bake --out comp' 'completion_test.sh'
exit $failed
