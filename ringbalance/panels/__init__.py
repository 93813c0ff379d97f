"""Pages that run in a browser: a panel on which one watches a scene's rotor being balanced.

`devices.py` packs laws and constants of the scene, its designs and its drawn devices; `controls.py` declares
what a reader can change; `blocks.py` brings the exported functions in JavaScript; `content.py` gathers all
numbers, and `document.py` makes one file of them and of the modules in `page/`, each of which Node imports.
"""
